# The folders of roscpp's messages, for builds that include definitions of this package.
set(roscpp_MSG_INCLUDE_DIRS "${CMAKE_CURRENT_LIST_DIR}/../msg")
set(roscpp_MSG_DEPENDENCIES "")
