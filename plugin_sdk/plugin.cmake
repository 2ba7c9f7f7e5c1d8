# How a folder becomes a plugin library.
#
#   <folder>/plugin.cc      -> <output>/<name>.so, which exports gravitas_plugin and nothing else
#   <folder>/other .cc      -> part of it, and by itself <name>_objects, so that tests can call the plain code
#   <folder>/plugin.cmake   -> read last, if there: for the rare plugin that needs a library of its own;
#                              sees ${plugin} and, if there is other code, ${objects}
set(GRAVITAS_PLUGIN_MAP ${CMAKE_CURRENT_LIST_DIR}/plugin.map)

# gravitas_plugin(<name> <folder> <output folder>)
function(gravitas_plugin name folder output)
  file(GLOB sources CONFIGURE_DEPENDS ${folder}/*.cc)
  set(plugin_source ${folder}/plugin.cc)
  list(REMOVE_ITEM sources ${plugin_source})
  set(plugin plugin_${name})
  set(objects ${name}_objects)

  if(sources)
    add_library(${objects} OBJECT ${sources})
    target_link_libraries(${objects} PUBLIC gravitas_sdk)
    target_compile_options(${objects} PRIVATE ${GRAVITAS_OPTIMISED})
    gravitas_share_precompiled(${objects} gravitas_sdk)
    set_property(GLOBAL APPEND PROPERTY GRAVITAS_PLUGIN_OBJECTS ${objects})
  endif()

  if(EXISTS ${plugin_source})
    add_library(${plugin} MODULE ${plugin_source})
    # without a symbol of its own for exports, which would keep it from sharing precompiled headers
    set_target_properties(${plugin} PROPERTIES
      PREFIX "" OUTPUT_NAME ${name} LIBRARY_OUTPUT_DIRECTORY ${output}
      DEFINE_SYMBOL "" LINK_DEPENDS ${GRAVITAS_PLUGIN_MAP})
    target_link_libraries(${plugin} PRIVATE gravitas_sdk)
    target_compile_options(${plugin} PRIVATE ${GRAVITAS_OPTIMISED})
    if(sources)
      target_link_libraries(${plugin} PRIVATE ${objects})
    endif()
    target_link_options(${plugin} PRIVATE
      -Wl,--exclude-libs,ALL -Wl,--gc-sections -Wl,--version-script=${GRAVITAS_PLUGIN_MAP})
    # every worker makes a private copy of the whole file
    target_link_options(${plugin} PRIVATE -Wl,--compress-debug-sections=zlib)
    # the sanitizers live in the program, so with them a library leaves symbols open
    if(NOT GRAVITAS_SANITIZERS)
      target_link_options(${plugin} PRIVATE -Wl,--no-undefined,-z,defs)
    endif()
    gravitas_share_precompiled(${plugin} gravitas_sdk)
    set_property(GLOBAL APPEND PROPERTY GRAVITAS_PLUGIN_TARGETS ${plugin})
  endif()

  if(EXISTS ${folder}/plugin.cmake)
    include(${folder}/plugin.cmake)
  endif()
endfunction()
