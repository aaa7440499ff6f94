# Debian packages by `cpack -G DEB` (scripts/package.sh): `bielle`, the command with its robots, `libbielle0.1`, the shared
# library that it runs on, `libbielle-dev`, `python3-bielle`, and `bielle-workers`, which is under the GPL.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME bielle)
set(CPACK_PACKAGE_CONTACT "the Bielle authors <bielle@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL command library development)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${PROJECT_BINARY_DIR}/lib)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_ENABLE_COMPONENT_DEPENDS ON)
set(CPACK_DEBIAN_PACKAGE_SECTION science)

set(CPACK_DEBIAN_COMMAND_PACKAGE_NAME bielle)
set(CPACK_COMPONENT_COMMAND_DESCRIPTION
  "The command: it models legged robots whose joints are driven through linkages, generates motions by
 optimal control and checks them. Robots, manual pages and completion included.")
set(CPACK_DEBIAN_COMMAND_PACKAGE_SUGGESTS "bielle-workers, gnuplot-nox, python3-ezdxf, chromium, ffmpeg, bash-completion")

set(CPACK_DEBIAN_LIBRARY_PACKAGE_NAME libbielle${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
set(CPACK_COMPONENT_LIBRARY_DESCRIPTION
  "The shared library, compiled for several levels of the processor; the dynamic linker loads the best.")
set(CPACK_DEBIAN_LIBRARY_PACKAGE_SECTION libs)
set(CPACK_COMPONENT_COMMAND_DEPENDS library)

set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libbielle-dev)
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION
  "The library: headers, with what find_package(bielle) and pkg-config look for.")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "libeigen3-dev (>= 3.4)")
set(CPACK_COMPONENT_DEVELOPMENT_DEPENDS library)

if(BIELLE_BUILD_PYTHON)
  math(EXPR next_minor "${Python3_VERSION_MINOR} + 1")
  list(APPEND CPACK_COMPONENTS_ALL python)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-bielle)
  set(CPACK_COMPONENT_PYTHON_DESCRIPTION
    "The package bielle for Python: robots, dynamics, motions, costs of one's own, controllers.")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SUGGESTS "python3-matplotlib, jupyter-notebook")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS
    "python3 (>= ${Python3_VERSION_MAJOR}.${Python3_VERSION_MINOR}), python3 (<< ${Python3_VERSION_MAJOR}.${next_minor}), python3-numpy")
  set(CPACK_COMPONENT_PYTHON_DEPENDS library command)  # robots come with the command
endif()

if(TARGET bielle-workers)
  list(APPEND CPACK_COMPONENTS_ALL workers)
  set(CPACK_DEBIAN_WORKERS_PACKAGE_NAME bielle-workers)
  set(CPACK_COMPONENT_WORKERS_DESCRIPTION
    "Tasks of Bielle on other machines: what the option --workers of the command needs, by Work Queue.")
  set(CPACK_DEBIAN_WORKERS_PACKAGE_RECOMMENDS coop-computing-tools)  # work_queue_worker; Work Queue itself is linked in
  set(CPACK_DEBIAN_WORKERS_PACKAGE_ENHANCES bielle)
endif()

# Each package says where Debian looks for it whose work it is.
if(BUILD_SHARED_LIBS)
  foreach(component IN LISTS CPACK_COMPONENTS_ALL)
    string(TOUPPER ${component} upper)
    set(license ${PROJECT_SOURCE_DIR}/LICENSE)
    if(component STREQUAL workers)
      set(license ${PROJECT_SOURCE_DIR}/workers/copyright)
    endif()
    install(FILES ${license} DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/doc/${CPACK_DEBIAN_${upper}_PACKAGE_NAME}
      RENAME copyright COMPONENT ${component})
  endforeach()
endif()

# A package must run on every machine of its architecture.
set(CPACK_PROJECT_CONFIG_FILE ${PROJECT_SOURCE_DIR}/cmake/refuse_native.cmake)
set(CPACK_BIELLE_NATIVE ${BIELLE_NATIVE})
set(CPACK_BIELLE_SHARED ${BUILD_SHARED_LIBS})
include(CPack)
