# Read by cpack before it packs.
if(CPACK_BIELLE_NATIVE OR NOT CPACK_BIELLE_SHARED)
  message(FATAL_ERROR "packages travel, and this build is tuned to its machine or has no shared library; configure with --preset package")
endif()
