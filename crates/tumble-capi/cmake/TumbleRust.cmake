# How cargo builds the library that CMake links.

include(${CMAKE_CURRENT_LIST_DIR}/TumbleParts.cmake)

# Sets `result` to Rust's name of the machine that is built for; empty where that is this machine.
function(tumble_find_rust_target result)
    set(${result} "" PARENT_SCOPE)
    if(NOT CMAKE_CROSSCOMPILING OR DEFINED CACHE{TUMBLE_RUST_TARGET})
        return()
    endif()
    # What the compiler does with floats decides, and not what the processor could do: calls have to fit.
    set(abi eabi)
    get_directory_property(options COMPILE_OPTIONS)
    if("${CMAKE_C_FLAGS} ${options}" MATCHES "-mfloat-abi=hard")
        set(abi eabihf)
    endif()
    # As in platformio/build.py and zephyr/Kconfig.
    string(TOLOWER "${CMAKE_SYSTEM_PROCESSOR}" processor)
    if(processor MATCHES "^cortex-m0(plus)?$")
        set(${result} thumbv6m-none-eabi PARENT_SCOPE)
    elseif(processor MATCHES "^cortex-m3$")
        set(${result} thumbv7m-none-eabi PARENT_SCOPE)
    elseif(processor MATCHES "^cortex-m[47]f?$")
        set(${result} thumbv7em-none-${abi} PARENT_SCOPE)
    elseif(processor MATCHES "^cortex-m(33|35p|55|85)f?$")
        set(${result} thumbv8m.main-none-${abi} PARENT_SCOPE)
    else()
        message(FATAL_ERROR "tumble: no Rust target is known for CMAKE_SYSTEM_PROCESSOR \"${CMAKE_SYSTEM_PROCESSOR}\"; "
            "set it to one like cortex-m4 in the toolchain file, or give -DTUMBLE_RUST_TARGET=thumbv7em-none-eabihf")
    endif()
endfunction()

function(tumble_check_units units)
    if(NOT units MATCHES "^[2-8]$")
        message(FATAL_ERROR "tumble: TUMBLE_UNITS is ${units}; it is 2 to 8, the primary included")
    endif()
endfunction()

# Sets `features` to cargo's options for the parts that are wanted, and `definitions` to the macros that say what was built:
# TUMBLE_UNITS, and TUMBLE_WITHOUT_SPIN and the like.
function(tumble_choose_parts features definitions)
    set(wanted freestanding)
    set(said TUMBLE_UNITS=${TUMBLE_UNITS})
    foreach(part ${TUMBLE_PARTS})
        if(TUMBLE_${part})
            string(TOLOWER ${part} feature)
            list(APPEND wanted ${feature})
        else()
            list(APPEND said TUMBLE_WITHOUT_${part})
        endif()
    endforeach()
    list(LENGTH said length)
    if(length EQUAL 1)
        # To cargo this is another library than one with all parts named.
        set(${features} --features freestanding PARENT_SCOPE)
    else()
        list(JOIN wanted "," wanted)
        set(${features} --no-default-features --features ${wanted} PARENT_SCOPE)
    endif()
    set(${definitions} ${said} PARENT_SCOPE)
endfunction()

# Adds tumble::tumble, whose file is `library`.
function(tumble_add_library library)
    set(built ${TUMBLE_CARGO_FOLDER})
    set(target)
    if(TUMBLE_RUST_TARGET)
        set(target --target ${TUMBLE_RUST_TARGET})
        string(APPEND built /${TUMBLE_RUST_TARGET})
    endif()
    # Cargo knows best whether anything changed, and is asked at every build.
    add_custom_target(tumble_cargo
        COMMAND ${CMAKE_COMMAND} -E env TUMBLE_UNITS=${TUMBLE_UNITS}
            ${TUMBLE_CARGO} rustc --quiet --locked --manifest-path ${CMAKE_CURRENT_SOURCE_DIR}/Cargo.toml
            --crate-type staticlib --profile device ${TUMBLE_FEATURES}
            --target-dir ${TUMBLE_CARGO_FOLDER} ${target}
        COMMAND ${CMAKE_COMMAND} -E copy_if_different ${built}/device/libtumble_capi.a ${library}
        BYPRODUCTS ${library}
        COMMENT "Building libtumble.a for ${TUMBLE_UNITS} units"
        VERBATIM)
    add_library(tumble::tumble STATIC IMPORTED GLOBAL)
    add_dependencies(tumble::tumble tumble_cargo)
    set_target_properties(tumble::tumble PROPERTIES
        IMPORTED_LOCATION ${library}
        INTERFACE_INCLUDE_DIRECTORIES ${CMAKE_CURRENT_SOURCE_DIR}/include
        INTERFACE_COMPILE_DEFINITIONS "${TUMBLE_DEFINITIONS}")
endfunction()
