# Functions that an object compiled for one set of instructions shares with the rest of the program: of equal copies the linker takes any,
# and one with AVX-512 in it would end the program on a processor without. Those that name their registers (xsimd::...) are no one else's.
execute_process(COMMAND ${nm} --demangle ${object} OUTPUT_VARIABLE symbols RESULT_VARIABLE result)
if(NOT result EQUAL 0 OR symbols STREQUAL "")
  message(FATAL_ERROR "${nm} cannot read ${object}")
endif()
string(REGEX MATCHALL "[0-9a-f]+ W [^\n]*" shared "${symbols}")
list(FILTER shared EXCLUDE REGEX "xsimd::")
list(FILTER shared EXCLUDE REGEX "__clang_call_terminate")  # two calls, nothing to vectorise
if(shared)
  list(JOIN shared "\n" text)
  message(FATAL_ERROR "shared functions in ${object}:\n${text}")
endif()
string(FIND "${symbols}" "xsimd::" found)
if(found EQUAL -1)
  message(FATAL_ERROR "${object} holds no function of its registers: the check sees nothing")
endif()
