# Everything vstent needs from outside; scripts/install-dependencies names the Debian packages.
find_package(Eigen3 3.4 REQUIRED)
# VTK first: it brings all of TBB's targets, which OpenVDB's own finder would define only in part.
find_package(VTK 9.1 REQUIRED COMPONENTS
  CommonCore CommonDataModel CommonExecutionModel IOXML IOLegacy IOImage
  FiltersCore RenderingCore RenderingOpenGL2 RenderingAnnotation RenderingFreeType
  RenderingUI)
find_package(TBB REQUIRED)
list(APPEND CMAKE_MODULE_PATH "/usr/lib/${CMAKE_LIBRARY_ARCHITECTURE}/cmake/OpenVDB")
find_package(OpenVDB 10.0 REQUIRED COMPONENTS openvdb)
find_package(CLI11 REQUIRED)
find_package(nlohmann_json 3.11 REQUIRED)
find_package(meshoptimizer REQUIRED)
find_package(Boost 1.74 REQUIRED COMPONENTS iostreams)
