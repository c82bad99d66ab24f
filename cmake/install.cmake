# cmake --install build --prefix P installs the programs and the library with its public headers (engine/api/trisoup),
# for find_package(trisoup).
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

install(TARGETS soup-train soup-simplify soup-view soup-edit soup-eval soup-export soup-bench
        RUNTIME COMPONENT programs)

set(libraries trisoup kernels)
if(TRISOUP_CUDA)
  list(APPEND libraries cuda_kernels)
endif()
install(TARGETS ${libraries} EXPORT trisoup-targets ARCHIVE COMPONENT development)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/engine/api/trisoup DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}
  COMPONENT development)
install(FILES ${PROJECT_BINARY_DIR}/engine/api/trisoup/version.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/trisoup
  COMPONENT development)

set(package ${CMAKE_INSTALL_LIBDIR}/cmake/trisoup)
install(EXPORT trisoup-targets NAMESPACE trisoup:: DESTINATION ${package} COMPONENT development)
configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/trisoup-config.cmake.in
                              ${PROJECT_BINARY_DIR}/trisoup-config.cmake INSTALL_DESTINATION ${package})
# Before 1.0 a minor version may change the interface.
write_basic_package_version_file(${PROJECT_BINARY_DIR}/trisoup-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/trisoup-config.cmake ${PROJECT_BINARY_DIR}/trisoup-config-version.cmake
        DESTINATION ${package} COMPONENT development)
