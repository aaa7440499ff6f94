bielle_test(lq SOURCES test_lq.cpp LIBS bielle_solve)
bielle_test(fddp SOURCES test_fddp.cpp LIBS bielle_solve bielle_model)
bielle_test(fddp_failures SOURCES test_fddp_failures.cpp LIBS bielle_solve bielle_model)
# The test counts allocations: malloc, and operator new(size_t) by its mangled name.
target_link_options(test_fddp PRIVATE -Wl,--wrap=malloc -Wl,--wrap=_Znwm)
bielle_test(fddp_batches SOURCES test_fddp_batches.cpp LIBS bielle_solve bielle_model)
target_link_options(test_fddp_batches PRIVATE -Wl,--wrap=malloc -Wl,--wrap=_Znwm)
bielle_test(constraints SOURCES test_constraints.cpp LIBS bielle_solve bielle_model)
target_link_options(test_constraints PRIVATE -Wl,--wrap=malloc -Wl,--wrap=_Znwm)
