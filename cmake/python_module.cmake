# python_module_interpreter(RESULT): sets RESULT to a Python interpreter of version 3.9 or later that has headers and
# NumPy, or to an empty text. Looks along PATH, then for Debian's, because python3 on PATH may belong to an environment
# without NumPy. If Python_EXECUTABLE is given, uses that, also without NumPy, which is not needed to build.
function(python_module_interpreter result)
  if(Python_EXECUTABLE)
    set(${result} ${Python_EXECUTABLE} PARENT_SCOPE)
    return()
  endif()
  set(candidates "")
  find_program(TRISOUP_PYTHON_ON_PATH NAMES python3 python)
  list(APPEND candidates ${TRISOUP_PYTHON_ON_PATH} /usr/bin/python3)
  set(${result} "" PARENT_SCOPE)
  foreach(candidate IN LISTS candidates)
    execute_process(COMMAND ${candidate} -c
      "import numpy, os, sys, sysconfig
headers = os.path.join(sysconfig.get_paths()['include'], 'Python.h')
sys.exit(not (sys.version_info >= (3, 9) and os.path.exists(headers)))"
      RESULT_VARIABLE failed OUTPUT_QUIET ERROR_QUIET)
    if(failed EQUAL 0)
      set(${result} ${candidate} PARENT_SCOPE)
      return()
    endif()
  endforeach()
endfunction()

if(NOT DEFINED TRISOUP_PYTHON OR TRISOUP_PYTHON)
  python_module_interpreter(interpreter)
endif()
# pybind11 may be a package of that Python, as in builds by pip.
if(interpreter AND NOT PYBIND11_INCLUDE_DIR)
  execute_process(COMMAND ${interpreter} -c "import pybind11; print(pybind11.get_include())"
    OUTPUT_VARIABLE pybind11_hint OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
endif()
find_path(PYBIND11_INCLUDE_DIR pybind11/pybind11.h HINTS ${pybind11_hint})
if(interpreter AND PYBIND11_INCLUDE_DIR)
  set(python_is_here ON)
else()
  set(python_is_here OFF)
endif()
option(TRISOUP_PYTHON "Build the Python module (needs Python's headers, NumPy and pybind11)" ${python_is_here})
if(TRISOUP_PYTHON)
  if(NOT interpreter OR NOT PYBIND11_INCLUDE_DIR)
    message(FATAL_ERROR "TRISOUP_PYTHON: Python's headers, NumPy or pybind11 are missing; "
                        "apt-get install python3-dev python3-numpy pybind11-dev")
  endif()
  set(TRISOUP_PYTHON_INTERPRETER ${interpreter})
  message(STATUS "Python: the module is built for ${interpreter}")
else()
  message(STATUS "Python: no module; Python's headers, NumPy or pybind11 are missing, or TRISOUP_PYTHON is off")
endif()

# linked_into_python(TARGET...): compiles static libraries so that the module can contain them. Programs run as fast:
# functions of the library are still inlined and called directly.
function(linked_into_python)
  if(NOT TRISOUP_PYTHON)
    return()
  endif()
  foreach(target IN LISTS ARGN)
    set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE ON)
    target_compile_options(${target} PRIVATE $<$<COMPILE_LANGUAGE:C,CXX>:-fno-semantic-interposition>)
  endforeach()
endfunction()
