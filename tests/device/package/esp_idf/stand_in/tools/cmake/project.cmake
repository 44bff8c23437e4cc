# Functions of ESP-IDF that a project and a component use, on this machine. Configuration comes from outside.
function(idf_build_set_property)
endfunction()

# Without sources a component is an interface; with them, here, it is the program.
macro(idf_component_register)
    cmake_parse_arguments(component "" "" "SRCS;INCLUDE_DIRS;PRIV_REQUIRES" ${ARGN})
    get_filename_component(COMPONENT_LIB ${CMAKE_CURRENT_SOURCE_DIR} NAME)
    if(component_SRCS)
        add_executable(${COMPONENT_LIB} ${component_SRCS} ${start})
        target_link_libraries(${COMPONENT_LIB} PRIVATE ${component_PRIV_REQUIRES})
    else()
        add_library(${COMPONENT_LIB} INTERFACE)
        target_include_directories(${COMPONENT_LIB} INTERFACE ${component_INCLUDE_DIRS})
    endif()
endmacro()

# Components come with the project; Tumble's own `project` comes here, too.
macro(project)
    _project(${ARGN})
    if(CMAKE_CURRENT_SOURCE_DIR STREQUAL CMAKE_SOURCE_DIR)
        set(start ${CMAKE_CURRENT_BINARY_DIR}/start.c)
        file(WRITE ${start} "void app_main(void); int main(void) { app_main(); return 0; }\n")
        add_subdirectory(${EXTRA_COMPONENT_DIRS}/tumble component)
        add_subdirectory(main)
    endif()
endmacro()
