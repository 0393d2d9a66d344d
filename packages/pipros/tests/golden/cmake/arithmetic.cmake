# Cases of arithmetic: a script that sets `o`, then the value that CMake 3.25 gives it, behind `#= `.

math(EXPR o "1 + 2 * 3")
#= 7

math(EXPR o "(1 + 2) * 3")
#= 9

math(EXPR o "-7 / 2")
#= -3

math(EXPR o "-7 % 3")
#= -1

math(EXPR o "7 % -3")
#= 1

math(EXPR o "7 / -2")
#= -3

math(EXPR o "
5")
#= 5

math(EXPR o "-(-3)")
#= 3

math(EXPR o "+4")
#= 4

math(EXPR o "1 << 4 | 1")
#= 17

math(EXPR o "6 & 3 ^ 1")
#= 3

math(EXPR o "256 >> 3")
#= 32

math(EXPR o "1 << 62")
#= 4611686018427387904

math(EXPR o "9223372036854775807 + 1")
#= -9223372036854775808

math(EXPR o "0x1F + 1")
#= 32

math(EXPR o "10" OUTPUT_FORMAT HEXADECIMAL)
#= 0xa

math(EXPR o "0xff" OUTPUT_FORMAT DECIMAL)
#= 255

math(EXPR o "-1" OUTPUT_FORMAT HEXADECIMAL)
#= 0xffffffffffffffff

math(EXPR o " 2  *  2 ")
#= 4

math(EXPR o "010 + 1")
#= 11

math(EXPR o "1 - -1")
#= 2

math(EXPR o "2*-3")
#= -6

math(EXPR o "1+2-3*4/5%6")
#= 1

math(EXPR o "100 - 10 - 1")
#= 89

math(EXPR o "1 | 2 & 3")
#= 3

math(EXPR o "--3")
#= 3

math(EXPR o "1 << 2 + 1")
#= 8

math(EXPR o "5 ^ 1 | 2")

#= 6

math(EXPR o "1 << 65")
#= 2

math(EXPR o "-8 >> 65")
#= -4

math(EXPR o "8 >> -1")
#= 0

math(EXPR o "007 * 2")
#= 14
