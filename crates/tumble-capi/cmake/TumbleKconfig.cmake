include(${CMAKE_CURRENT_LIST_DIR}/TumbleParts.cmake)

# Sets the variables of CMakeLists.txt from the configuration of Zephyr or ESP-IDF, CONFIG_TUMBLE_....
macro(tumble_take_kconfig)
    set(TUMBLE_UNITS ${CONFIG_TUMBLE_UNITS} CACHE STRING "Of CONFIG_TUMBLE_UNITS" FORCE)
    foreach(part ${TUMBLE_PARTS})
        set(TUMBLE_${part} "${CONFIG_TUMBLE_${part}}" CACHE BOOL "Of CONFIG_TUMBLE_${part}" FORCE)
    endforeach()
    set(TUMBLE_RUST_TARGET "${CONFIG_TUMBLE_RUST_TARGET}" CACHE STRING "Of CONFIG_TUMBLE_RUST_TARGET" FORCE)
endmacro()
