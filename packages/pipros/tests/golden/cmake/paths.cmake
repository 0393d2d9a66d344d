# Cases of paths: a script that sets `o`, then the value that CMake 3.25 gives it, behind `#= `.

get_filename_component(o /a/b.tar.gz DIRECTORY)
#= /a

get_filename_component(o /a/b.tar.gz PATH)
#= /a

get_filename_component(o /a/b.tar.gz NAME)
#= b.tar.gz

get_filename_component(o /a/b.tar.gz EXT)
#= .tar.gz

get_filename_component(o /a/b.tar.gz NAME_WE)
#= b

get_filename_component(o /a/b.tar.gz LAST_EXT)
#= .gz

get_filename_component(o /a/b.tar.gz NAME_WLE)
#= b.tar

get_filename_component(o C:/a DIRECTORY)
#= C:/

get_filename_component(o C:/ DIRECTORY)
#= C:/

get_filename_component(o //server/share/a DIRECTORY)
#= //server/share

get_filename_component(o a DIRECTORY)
set(o "<${o}>")
#= <>

get_filename_component(o /a DIRECTORY)
#= /

get_filename_component(o /a/ DIRECTORY)
#= /

get_filename_component(o /a/b/ NAME)
set(o "<${o}>")
#= <>

get_filename_component(o .hidden NAME_WE)
set(o "<${o}>")
#= <>

get_filename_component(o .hidden EXT)
#= .hidden

get_filename_component(o a. EXT)
#= .

get_filename_component(o ../x ABSOLUTE BASE_DIR /a/b)
#= /a/x

get_filename_component(o /a/./b/../c ABSOLUTE)
#= /a/c

get_filename_component(o x/y ABSOLUTE BASE_DIR /r)
#= /r/x/y

get_filename_component(o / DIRECTORY)
#= /

get_filename_component(o / NAME)
set(o "<${o}>")
#= <>

get_filename_component(o a/b/c.x NAME)
#= c.x

get_filename_component(o "" NAME)
set(o "<${o}>")
#= <>

get_filename_component(o sh PROGRAM)
if(o)
set(o found)
endif()
#= found

get_filename_component(o a.b/c EXT)
set(o "<${o}>")
#= <>

get_filename_component(o a.b/c NAME_WE)
#= c

find_program(P nope_nope_nope)
set(o "${P}")
#= P-NOTFOUND

find_file(P nope_nope_nope PATHS /)
set(o "${P}")
#= P-NOTFOUND

find_path(P nope_nope_nope PATHS /)
set(o "${P}")
#= P-NOTFOUND

file(RELATIVE_PATH o /a/b /a/c/d)
#= ../c/d

file(RELATIVE_PATH o /a /a)
set(o "<${o}>")
#= <>

file(RELATIVE_PATH o /a/b/c /a)
#= ../../

file(TO_CMAKE_PATH "/a:/b" o)
#= /a;/b

file(TO_NATIVE_PATH "/a/b" o)
#= /a/b

file(REAL_PATH /a/../b o)

#= /b

get_filename_component(o a//b DIRECTORY)
#= a

get_filename_component(o a/b/ DIRECTORY)
#= a

file(RELATIVE_PATH o /a/b /a)
#= ../

file(RELATIVE_PATH o / /a)
#= a

file(RELATIVE_PATH o /a/b /)
#= ../../

file(RELATIVE_PATH o /a/b/ /a/c/)
#= ../c
