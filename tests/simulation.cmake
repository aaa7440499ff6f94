if(BIELLE_BUILD_SIMULATION)
  bielle_test(terrain SOURCES test_terrain.cpp LIBS bielle_simulation)
endif()
