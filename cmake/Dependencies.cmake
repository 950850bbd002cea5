# Everything vstent needs from outside; scripts/install-dependencies names the Debian packages.
list(APPEND CMAKE_MODULE_PATH "/usr/lib/${CMAKE_LIBRARY_ARCHITECTURE}/cmake/OpenVDB")
find_package(Eigen3 3.4 REQUIRED)
find_package(TBB REQUIRED)
set(CMAKE_POLICY_DEFAULT_CMP0074 NEW)
find_package(OpenVDB 10.0 REQUIRED COMPONENTS openvdb)
find_package(VTK 9.1 REQUIRED COMPONENTS
  CommonCore CommonDataModel CommonExecutionModel IOXML IOLegacy IOGeometry IOImage
  FiltersCore FiltersGeneral RenderingCore RenderingOpenGL2 RenderingAnnotation RenderingFreeType)
find_package(CLI11 REQUIRED)
find_package(nlohmann_json 3.11 REQUIRED)
