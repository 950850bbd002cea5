# vstent_module(<folder> SOURCES ... LINK ...): folder = namespace = target vstent::<folder> = include prefix.
add_library(vstent_options INTERFACE)
target_compile_options(vstent_options INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wconversion -fno-math-errno)
if(VSTENT_WARNINGS_AS_ERRORS)
  target_compile_options(vstent_options INTERFACE -Werror)
endif()
if(VSTENT_SANITIZE)
  target_compile_options(vstent_options INTERFACE -fsanitize=address,undefined -fno-sanitize-recover=undefined
                         -fno-omit-frame-pointer)
  target_link_options(vstent_options INTERFACE -fsanitize=address,undefined)
endif()

function(vstent_module name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LINK;PRIVATE_LINK" ${ARGN})
  add_library(vstent_${name} STATIC ${ARG_SOURCES})
  add_library(vstent::${name} ALIAS vstent_${name})
  target_include_directories(vstent_${name} PUBLIC ${PROJECT_SOURCE_DIR})
  target_link_libraries(vstent_${name} PUBLIC ${ARG_LINK} PRIVATE vstent_options ${ARG_PRIVATE_LINK})
endfunction()

# vstent_test(<folder> SOURCES ... LINK ...): one GoogleTest program test_<folder>, found by CTest case by case.
function(vstent_test name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LINK" ${ARGN})
  add_executable(test_${name} ${ARG_SOURCES})
  target_include_directories(test_${name} PRIVATE ${PROJECT_SOURCE_DIR})
  target_link_libraries(test_${name} PRIVATE vstent_options ${ARG_LINK} GTest::gtest_main)
  target_compile_definitions(test_${name} PRIVATE
    VSTENT_SHARED_DATA="${PROJECT_SOURCE_DIR}/../shared/data"
    VSTENT_SHARED_REFERENCE="${PROJECT_SOURCE_DIR}/../shared/reference")
  gtest_discover_tests(test_${name} DISCOVERY_TIMEOUT 60 PROPERTIES TIMEOUT 600)
endfunction()
