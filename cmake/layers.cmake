# How the layers of src become libraries.
#
# BIELLE_NATIVE=ON: one static library per layer, tuned to this machine. The linker holds the one-way includes.
# BIELLE_NATIVE=OFF: one shared library of all layers. On x86-64 it is compiled once for every machine, and once more for
# each of BIELLE_LEVELS, the levels of the x86-64 psABI (v3 has AVX2 and FMA, v4 has AVX-512):
#   lib/libbielle.so.0.1
#   lib/glibc-hwcaps/x86-64-v3/libbielle.so.0.1
#   lib/glibc-hwcaps/x86-64-v4/libbielle.so.0.1
# The dynamic linker of glibc 2.33 or later loads the best of them that the processor can run; an older one loads the
# first. Programs are compiled for every machine. Three things make the libraries interchangeable:
# - Alignment, which Eigen chooses by instruction set, is fixed for the library and for its users (bielle_headers).
# - The library exports namespace bielle alone (layers.map). Eigen's kernels, whose packets differ from level to level,
#   thus never replace those of the program or of another library.
# - A function that the program and the library both define, such as a template of namespace bielle, is called by each in
#   its own copy (-Bsymbolic-functions).
# Whether Lanes travel in registers or in memory depends on the level: no function that programs call may take or return
# them by value.
if(BIELLE_NATIVE)
  option(BUILD_SHARED_LIBS "One shared library instead of a static one per layer" OFF)
  set(BIELLE_LEVELS "")
else()
  option(BUILD_SHARED_LIBS "One shared library instead of a static one per layer" ON)
  if(CMAKE_SYSTEM_NAME STREQUAL Linux AND CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|amd64)$")
    set(BIELLE_LEVELS x86-64-v3 x86-64-v4 CACHE STRING "Levels of x86-64 that the shared library is also compiled for")
  endif()
endif()

# What users of the library must share with it.
add_library(bielle_headers INTERFACE)
set_target_properties(bielle_headers PROPERTIES EXPORT_NAME headers)
target_include_directories(bielle_headers INTERFACE
  $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
target_link_libraries(bielle_headers INTERFACE Eigen3::Eigen)
target_compile_features(bielle_headers INTERFACE cxx_std_17)
# Nodes run in parallel, matrix products do not: Eigen's own threads allocate and would make results depend on their number.
target_compile_definitions(bielle_headers INTERFACE EIGEN_DONT_PARALLELIZE)
if(BIELLE_NATIVE)
  # Eigen's alignment depends on it, and its functions, which the linker takes once, do as well.
  target_compile_options(bielle_headers INTERFACE -march=native)
endif()
# Vectors of eight numbers (math/lanes.h) have this alignment whatever the processor, and Eigen may not ask for less: clang refuses.
target_compile_definitions(bielle_headers INTERFACE EIGEN_MAX_ALIGN_BYTES=64 EIGEN_MAX_STATIC_ALIGN_BYTES=64)

# bielle_shared_library(TARGET FOLDER): the shared library, without layers so far.
function(bielle_shared_library target folder)
  set(map ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/layers.map)
  add_library(${target} SHARED)
  set_target_properties(${target} PROPERTIES OUTPUT_NAME bielle EXPORT_NAME library LINKER_LANGUAGE CXX
    SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR}
    LIBRARY_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/lib/${folder} LINK_DEPENDS ${map})
  target_link_options(${target} PRIVATE -Wl,-Bsymbolic-functions -Wl,--version-script=${map})
  target_link_libraries(${target} PUBLIC bielle_headers)
endfunction()

if(BUILD_SHARED_LIBS)
  bielle_shared_library(bielle_library .)
  foreach(level IN LISTS BIELLE_LEVELS)
    bielle_shared_library(bielle_library_${level} glibc-hwcaps/${level})
    add_dependencies(bielle_library bielle_library_${level})
  endforeach()
endif()

# bielle_embed(LIST FILES...): the list of files that model/embed.h copies into a program, in the current binary directory.
function(bielle_embed list)
  set(entries "")
  foreach(file IN LISTS ARGN)
    get_filename_component(name ${file} NAME)
    string(MAKE_C_IDENTIFIER ${name} id)
    string(APPEND entries "BIELLE_FILE(${id}, \"${name}\", \"${file}\")\n")
  endforeach()
  file(CONFIGURE OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/${list} CONTENT "${entries}")
endfunction()

# bielle_precompile(TARGET KIND HEADERS...): headers of the standard library and of Eigen that most files include are parsed once
# for all targets of a KIND, whose flags are the same. A file that forgets one of them still compiles; scripts/check_includes.sh
# finds it. A header whose inline functions call templates makes every file instantiate them: CLI11, 4 s each, is left to the
# files that include it. Headers of Bielle are not among them, so that a change of one rebuilds only the
# files that include it; but for math/decompositions.h, which declares what Eigen's headers would have every file compile.
option(BIELLE_PRECOMPILE "Precompile headers" ON)
function(bielle_precompile target kind)
  if(NOT BIELLE_PRECOMPILE OR BUILD_SHARED_LIBS)
    return()
  endif()
  get_property(first GLOBAL PROPERTY BIELLE_PRECOMPILED_${kind})
  if(first)
    target_precompile_headers(${target} REUSE_FROM ${first})
  else()
    set_property(GLOBAL PROPERTY BIELLE_PRECOMPILED_${kind} ${target})
    target_precompile_headers(${target} PRIVATE <algorithm> <array> <cmath> <functional> <map> <memory> <optional> <set>
      <string> <vector> <Eigen/Core> <Eigen/Geometry> ${ARGN})
  endif()
endfunction()

# bielle_fast(TARGET): a room whose speed `bielle bench` shows. Its files are compiled at -O3, those of a bielle_group together
# and the others each by itself, in a unity build or not, so that what the compiler makes of a function does not depend on how
# the rest is built. Left to itself, GCC calls functions of Eigen for single entries of small matrices of Lanes, which takes a
# fifth of the time of predictive control.
function(bielle_fast target)
  if(NOT BIELLE_SANITIZE)
    # Without precompiled headers, for scripts/check_includes.sh, every file is by itself.
    set_target_properties(${target} PROPERTIES UNITY_BUILD ${BIELLE_PRECOMPILE} UNITY_BUILD_MODE GROUP)
    if(CMAKE_CXX_COMPILER_ID MATCHES "GNU|Clang")
      target_compile_definitions(${target} PRIVATE "EIGEN_STRONG_INLINE=__attribute__((always_inline)) inline")
    endif()
    target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>)
  endif()
  bielle_precompile(${target} fast)
endfunction()

# bielle_group(NAME SOURCES...): sources of a fast room that use the same templates, which are then instantiated once for all of
# them: a third of the compiler's time. Their anonymous namespaces are one. A group may take a compiler 1.2 GB.
function(bielle_group name)
  set_source_files_properties(${ARGN} PROPERTIES UNITY_GROUP ${name})
endfunction()

# bielle_plain(TARGET): everything else. -O1 takes three quarters of the time to compile; GCC 12 then reports its AVX-512
# intrinsics once more, and takes a source within a unity for a header. Programs are compiled as libraries are (-fPIC), or else
# their precompiled headers would not fit.
function(bielle_plain target)
  target_compile_options(${target} PRIVATE -fPIC $<$<CONFIG:Release>:-O1> $<$<CXX_COMPILER_ID:GNU>:-Wno-uninitialized;-Wno-subobject-linkage>)
  bielle_precompile(${target} plain <filesystem> <iostream> <sstream> "${PROJECT_SOURCE_DIR}/src/math/decompositions.h")
endfunction()

function(bielle_tune target fast)
  if(fast)
    bielle_fast(${target})
  else()
    bielle_plain(${target})
  endif()
endfunction()

# bielle_layer(NAME [FAST] [ENTERED] SOURCES... PLAIN SOURCES... INCLUDE DIRECTORIES... PUBLIC LIBRARIES... PRIVATE LIBRARIES...): the
# target bielle_NAME. PLAIN are the sources of a fast room that no benchmark shows. A layer that is ENTERED in tables when a program
# starts (model/missing_part.h) defines the symbol bielle_NAME, for which the linker takes its object out of the static library.
function(bielle_layer name)
  cmake_parse_arguments(ARG "FAST;ENTERED" "" "SOURCES;PLAIN;INCLUDE;PUBLIC;PRIVATE" ${ARGN})
  set_property(GLOBAL APPEND PROPERTY BIELLE_LAYERS bielle_${name})
  if(BUILD_SHARED_LIBS)
    add_library(bielle_${name} INTERFACE)
    target_link_libraries(bielle_${name} INTERFACE bielle_library)
    list(FILTER ARG_PUBLIC EXCLUDE REGEX "^bielle_")  # the layers below are in the same library
    foreach(level IN ITEMS "" LISTS BIELLE_LEVELS)
      string(JOIN _ suffix "" ${level})
      set(objects bielle_${name}_objects${suffix})
      add_library(${objects} OBJECT ${ARG_SOURCES} ${ARG_PLAIN})
      target_include_directories(${objects} PRIVATE ${PROJECT_SOURCE_DIR}/src ${ARG_INCLUDE})
      target_link_libraries(${objects} PRIVATE bielle_headers ${ARG_PUBLIC} ${ARG_PRIVATE} bielle_warnings)
      bielle_tune(${objects} ${ARG_FAST})
      if(level)
        target_compile_options(${objects} PRIVATE -march=${level} -mtune=generic)
        if(level STREQUAL x86-64-v3 AND CMAKE_CXX_COMPILER_ID STREQUAL GNU
            AND CMAKE_CXX_COMPILER_VERSION VERSION_GREATER_EQUAL 12)
          # Lanes are copied by whole registers. By halves, as the tuning says, loads that follow wait for the stores.
          target_compile_options(${objects} PRIVATE -mmove-max=256 -mstore-max=256)
        endif()
      endif()
      target_link_libraries(bielle_library${suffix} PRIVATE ${objects})
    endforeach()
  else()
    add_library(bielle_${name} STATIC ${ARG_SOURCES})
    target_include_directories(bielle_${name} PRIVATE ${PROJECT_SOURCE_DIR}/src ${ARG_INCLUDE})
    target_link_libraries(bielle_${name}
      PUBLIC bielle_headers ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE} $<BUILD_INTERFACE:bielle_warnings>)
    if(ARG_ENTERED)
      target_link_options(bielle_${name} INTERFACE LINKER:--undefined=bielle_${name})
      set_property(GLOBAL APPEND PROPERTY BIELLE_ENTERED bielle_${name})
    endif()
    bielle_tune(bielle_${name} ${ARG_FAST})
    if(ARG_PLAIN)
      add_library(bielle_${name}_plain OBJECT ${ARG_PLAIN})
      target_include_directories(bielle_${name}_plain PRIVATE ${PROJECT_SOURCE_DIR}/src ${ARG_INCLUDE})
      target_link_libraries(bielle_${name}_plain PRIVATE bielle_headers ${ARG_PUBLIC} ${ARG_PRIVATE} bielle_warnings)
      bielle_plain(bielle_${name}_plain)
      target_sources(bielle_${name} PRIVATE $<TARGET_OBJECTS:bielle_${name}_plain>)
    endif()
  endif()
  add_library(bielle::${name} ALIAS bielle_${name})
  set_target_properties(bielle_${name} PROPERTIES EXPORT_NAME ${name})
endfunction()
