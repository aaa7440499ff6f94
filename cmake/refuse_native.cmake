# Read by cpack before it packs.
if(CPACK_BIELLE_NATIVE)
  message(FATAL_ERROR "this build is tuned to its machine; configure with --preset package (BIELLE_NATIVE=OFF)")
endif()
