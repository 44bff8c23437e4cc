# What `cmake --install` puts where find_package(tumble) and pkg-config find it.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

add_custom_target(tumble_all ALL DEPENDS tumble_cargo)

set(folder ${CMAKE_INSTALL_LIBDIR}/cmake/tumble)
configure_package_config_file(cmake/tumbleConfig.cmake.in ${CMAKE_CURRENT_BINARY_DIR}/tumbleConfig.cmake
    INSTALL_DESTINATION ${folder} PATH_VARS CMAKE_INSTALL_INCLUDEDIR CMAKE_INSTALL_LIBDIR)
# Before 1.0 a minor version may change the interface.
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/tumbleConfigVersion.cmake
    COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/libtumble.a DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(FILES include/tumble.h include/tumble.hpp DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/tumbleConfig.cmake ${CMAKE_CURRENT_BINARY_DIR}/tumbleConfigVersion.cmake
    DESTINATION ${folder})

set(folder ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
list(TRANSFORM TUMBLE_DEFINITIONS PREPEND -D OUTPUT_VARIABLE TUMBLE_MACROS)
list(JOIN TUMBLE_MACROS " " TUMBLE_MACROS)
file(RELATIVE_PATH TUMBLE_PREFIX_FROM_PC /prefix/${folder} /prefix)
configure_file(cmake/tumble.pc.in ${CMAKE_CURRENT_BINARY_DIR}/tumble.pc @ONLY)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/tumble.pc DESTINATION ${folder})
