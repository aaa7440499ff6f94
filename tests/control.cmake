bielle_test(policy SOURCES test_policy.cpp LIBS bielle_control)
target_link_options(test_policy PRIVATE -Wl,--wrap=malloc -Wl,--wrap=_Znwm)
