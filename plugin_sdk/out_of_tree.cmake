# How a plugin that lies outside of this tree becomes a library, with the numeric options of this tree, and with the compiler of
# a build of it unless CMAKE_CXX_COMPILER or CXX name another. CMAKE_CXX_FLAGS and the build type of that build are not taken
# over; one with sanitizers is refused. Included by its CMakeLists.txt before project(), so that the compiler can be chosen:
#
#   set(GRAVITAS_BUILD …)               the build; <this tree>/build/release if empty
#   include(<this tree>/plugin_sdk/out_of_tree.cmake)
#   project(<name> LANGUAGES CXX)
#   gravitas_out_of_tree_plugin(<target> <name> <source>...)     <name>.so, in the folder of its build
#   gravitas_out_of_tree_program(<target> <source>...)           a program that may call the SDK
#
# Sets GRAVITAS_PROGRAM, the command line. `gravitas new` writes a project that uses this.
include(${CMAKE_CURRENT_LIST_DIR}/numeric_options.cmake)
set(GRAVITAS_PLUGIN_MAP ${CMAKE_CURRENT_LIST_DIR}/plugin.map)
cmake_path(GET CMAKE_CURRENT_LIST_DIR PARENT_PATH GRAVITAS_TREE)
if(NOT GRAVITAS_BUILD)
  set(GRAVITAS_BUILD ${GRAVITAS_TREE}/build/release)
endif()
# what is linked is looked for in other folders than this file
get_filename_component(GRAVITAS_BUILD "${GRAVITAS_BUILD}" ABSOLUTE)
set(GRAVITAS_PROGRAM ${GRAVITAS_BUILD}/bin/gravitas)
foreach(needed IN ITEMS CMakeCache.txt bin/gravitas bin/gravitas-worker archives/libgravitas_sdk.a
    generated/schemas/stage_frames.h)
  if(NOT EXISTS ${GRAVITAS_BUILD}/${needed})
    message(FATAL_ERROR "Gravitas is not built in '${GRAVITAS_BUILD}', which has no ${needed}; required: "
      "${GRAVITAS_TREE}/deploy/build_preset release runtime, or another build with -DGRAVITAS_BUILD=<folder>")
  endif()
endforeach()

file(STRINGS ${GRAVITAS_BUILD}/CMakeCache.txt sanitizers REGEX "^GRAVITAS_SANITIZERS:[^=]*=.")
if(sanitizers)
  string(REGEX REPLACE "^[^=]*=" "" sanitizers "${sanitizers}")
  message(FATAL_ERROR "Gravitas was built with sanitizers (${sanitizers}) in '${GRAVITAS_BUILD}'; required: "
    "a build without, such as -DGRAVITAS_BUILD=${GRAVITAS_TREE}/build/release")
endif()

if(NOT CMAKE_CXX_COMPILER AND NOT DEFINED ENV{CXX})
  file(STRINGS ${GRAVITAS_BUILD}/CMakeCache.txt compiler REGEX "^CMAKE_CXX_COMPILER:")
  string(REGEX REPLACE "^[^=]*=" "" CMAKE_CXX_COMPILER "${compiler}")
endif()
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release)
endif()
# with what a debugger needs
set(CMAKE_CXX_FLAGS_RELEASE "-O2 -g -DNDEBUG")
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)

# What plugins and programs are compiled and linked with.
function(gravitas_out_of_tree_target target)
  find_package(Eigen3 REQUIRED)
  find_package(Threads REQUIRED)
  # hulls of convex polyhedra, which what uses geometry/ may need
  find_library(GRAVITAS_QHULL qhull_r REQUIRED)
  target_include_directories(${target} PRIVATE ${GRAVITAS_TREE} ${GRAVITAS_BUILD}/generated)
  target_compile_options(${target} PRIVATE ${GRAVITAS_NUMERIC_OPTIONS}
    -fPIC -fvisibility=hidden -fvisibility-inlines-hidden -Wall -Wextra)
  target_link_libraries(${target} PRIVATE ${GRAVITAS_BUILD}/archives/libgravitas_sdk.a
    Eigen3::Eigen Threads::Threads ${GRAVITAS_QHULL} ${CMAKE_DL_LIBS})
endfunction()

function(gravitas_out_of_tree_plugin target name)
  add_library(${target} MODULE ${ARGN})
  gravitas_out_of_tree_target(${target})
  set_target_properties(${target} PROPERTIES PREFIX "" OUTPUT_NAME ${name} LINK_DEPENDS ${GRAVITAS_PLUGIN_MAP})
  target_link_options(${target} PRIVATE
    -Wl,--exclude-libs,ALL,--gc-sections,--no-undefined,--as-needed,--version-script=${GRAVITAS_PLUGIN_MAP})
endfunction()

function(gravitas_out_of_tree_program target)
  add_executable(${target} ${ARGN})
  gravitas_out_of_tree_target(${target})
  target_link_options(${target} PRIVATE -Wl,--gc-sections)
endfunction()
