bielle_test(report SOURCES test_report.cpp LIBS bielle_views)
# In a browser; skipped where there is no Chromium.
if(TARGET bielle_command)
  add_test(NAME report_page COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/test_report_page.py
    $<TARGET_FILE:bielle_command>)
  add_test(NAME design_page COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_SOURCE_DIR}/test_design_page.py
    $<TARGET_FILE:bielle_command>)
  set_tests_properties(report_page design_page PROPERTIES LABELS system SKIP_RETURN_CODE 77 TIMEOUT 600)
endif()
