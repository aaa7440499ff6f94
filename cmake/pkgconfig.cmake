# bielle.pc, from what the layers say of themselves: the flags their users must share, and all they link.
set(pkgconfig_flags -std=c++17 ${OpenMP_CXX_FLAGS})
foreach(kind DEFINITIONS OPTIONS)
  get_target_property(flags bielle_math INTERFACE_COMPILE_${kind})
  if(flags)
    if(kind STREQUAL DEFINITIONS)
      list(TRANSFORM flags PREPEND -D)
    endif()
    list(APPEND pkgconfig_flags ${flags})
  endif()
endforeach()
list(JOIN pkgconfig_flags " " pkgconfig_flags)

# Those above first. What they read robots with is found by its name where the linker looks anyhow.
get_property(layers GLOBAL PROPERTY BIELLE_LAYERS)
list(REVERSE layers)
list(TRANSFORM layers PREPEND -l OUTPUT_VARIABLE pkgconfig_libraries)
foreach(library zip nlopt_cxx nlopt urdfdom_model console_bridge tinyxml yaml-cpp)
  list(APPEND pkgconfig_libraries -l${library})
endforeach()
list(JOIN pkgconfig_libraries " " pkgconfig_libraries)
string(APPEND pkgconfig_libraries " ${OpenMP_CXX_FLAGS}")

# Where the file stands tells the prefix, so that an installation can be moved.
set(pkgconfig_directory ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
file(RELATIVE_PATH pkgconfig_prefix /prefix/${pkgconfig_directory} /prefix)
string(REGEX REPLACE "/$" "" pkgconfig_prefix ${pkgconfig_prefix})
configure_file(cmake/bielle.pc.in ${PROJECT_BINARY_DIR}/bielle.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/bielle.pc DESTINATION ${pkgconfig_directory} COMPONENT development)
