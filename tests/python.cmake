# The Python package, by pytest, one test of CTest per file.
if(TARGET bielle_python)
  set(environment "PYTHONPATH=${PROJECT_BINARY_DIR}/python;PYTHONDONTWRITEBYTECODE=1")
  # bielle_python_test(NAME LABEL): python/tests/test_NAME.py
  function(bielle_python_test name label)
    add_test(NAME python_${name} COMMAND ${Python3_EXECUTABLE} -m pytest -q -p no:cacheprovider
      ${PROJECT_SOURCE_DIR}/python/tests/test_${name}.py)
    set_tests_properties(python_${name} PROPERTIES LABELS "${label}"
      ENVIRONMENT "${environment};BIELLE_COMMAND=$<TARGET_FILE:bielle_command>")
  endfunction()
  bielle_python_test(model unit)
  bielle_python_test(arguments unit)
  bielle_python_test(values unit)
  bielle_python_test(names unit)
  bielle_python_test(motions system)
  bielle_python_test(residuals system)
  bielle_python_test(worlds system)
  bielle_python_test(design system)
  bielle_python_test(programs system)
  bielle_python_test(examples system)
  bielle_python_test(notebooks system)
endif()
