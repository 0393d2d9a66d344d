# Cases of programs: a script that sets `o`, then the value that CMake 3.25 gives it, behind `#= `.

execute_process(COMMAND printf a OUTPUT_VARIABLE o)
#= a

execute_process(COMMAND printf "a\n\n" OUTPUT_VARIABLE o OUTPUT_STRIP_TRAILING_WHITESPACE)
#= a

execute_process(COMMAND sh -c "exit 3" RESULT_VARIABLE o)
#= 3

execute_process(COMMAND nope_nope_nope RESULT_VARIABLE o)
#= No such file or directory

execute_process(COMMAND printf "b\na\n" COMMAND sort OUTPUT_VARIABLE o)
#= a
#= b
#=

execute_process(COMMAND sh -c "printf e >&2" ERROR_VARIABLE o OUTPUT_QUIET)
#= e

execute_process(COMMAND sh -c "printf a; printf b >&2" OUTPUT_VARIABLE o ERROR_VARIABLE o)
string(LENGTH "${o}" o)
#= 2

execute_process(COMMAND false COMMAND true RESULTS_VARIABLE o)
#= 1;0

execute_process(COMMAND pwd WORKING_DIRECTORY / OUTPUT_VARIABLE o OUTPUT_STRIP_TRAILING_WHITESPACE)
#= /

set(ENV{MY_X} 7)
execute_process(COMMAND sh -c "printf \$MY_X" OUTPUT_VARIABLE o)
#= 7

execute_process(COMMAND printf "%s," "a b" "c;d" OUTPUT_VARIABLE o)
#= a b,c;d,

execute_process(COMMAND true RESULT_VARIABLE o)
#= 0

file(WRITE w/in "x")
execute_process(COMMAND cat INPUT_FILE w/in OUTPUT_VARIABLE o WORKING_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR})
#= x
