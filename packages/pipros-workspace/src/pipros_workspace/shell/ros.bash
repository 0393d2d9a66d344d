# The shell functions of ROS for bash: roscd, rospd, rosd, rosls, rosed, roscat, roscp, rosmv, and completion.

_pipros_place() {  # package[/path], or log[/path], command -> path
  local package=${1%%/*} folder
  if [ "$package" = log ]; then
    folder=$(roslaunch-logs) || folder=${ROS_LOG_DIR:-${ROS_HOME:-$HOME/.ros}/log}
  elif [ -z "$package" ] || ! folder=$(rospack -q find "$package" 2> /dev/null); then
    echo "$2: No such package/stack '$1'"
    pipros-complete --similar "$package" 2> /dev/null
    return 1
  fi
  if [ "$package" = "$1" ]; then echo "$folder"; else echo "$folder/${1#*/}"; fi
}

_pipros_file() {  # package file -> path of the file, chosen by the user if several match
  local found choice
  if ! rospack -q find "$1" > /dev/null 2>&1; then
    echo "Couldn't find package [$1]" >&2
    pipros-complete --similar "$1" >&2 2> /dev/null
    return 1
  fi
  mapfile -t found < <(pipros-complete --find "$1" "$2")
  case ${#found[@]} in
    0) echo "That file does not exist in that package." >&2; return 1 ;;
    1) echo "${found[0]}" ;;
    *) echo "You have chosen a non-unique filename, please pick one of the following:" >&2
       select choice in "${found[@]}"; do echo "$choice"; break; done ;;
  esac
}

_pipros_usage() {  # usage text option -> 0 for --help, otherwise 1
  printf 'usage: %s\n\n%s\n' "$1" "$2"
  [ "$3" = --help ]
}

roscd() {
  local place
  if [ $# -gt 1 ] || [ "$1" = --help ]; then
    _pipros_usage "roscd package" "Jump to target package." --help
    return
  fi
  if [ $# -eq 0 ]; then
    place=${ROS_WORKSPACE:-${CMAKE_PREFIX_PATH%%:*}}
    if [ -z "$ROS_WORKSPACE" ] && [ ! -f "$place/.catkin" ]; then
      echo "No workspace is set up: source its devel/setup.bash, or set ROS_WORKSPACE, to use roscd without a package"
      return 1
    fi
  elif ! place=$(_pipros_place "$1" roscd); then
    echo "$place"
    return 1
  fi
  cd "$place"
}

rosd() {
  local folder number=0
  while read -r folder; do
    echo "$number $folder"
    number=$((number + 1))
  done < <(dirs -l -p)
}

rospd() {
  local place
  if [[ $1 =~ ^[0-9]+$ ]]; then
    pushd "+$1" > /dev/null || return
  elif place=$(_pipros_place "$1" rospd); then
    pushd "$place" > /dev/null || return
  else
    echo "$place"
    return 1
  fi
  rosd
}

rosls() {
  local place
  if [ "$1" = --help ] || [ $# -eq 0 ]; then
    _pipros_usage "rosls [package]" "Lists contents of a package directory." "$1"
    return
  fi
  if ! place=$(_pipros_place "$1" rosls); then
    echo "$place" >&2
    return 1
  fi
  shift
  ls "$@" "$place"
}

rosed() {
  local file
  if [ $# -ne 2 ]; then
    _pipros_usage "rosed [package] [file]" "Edit a file within a package." "$1"
    return
  fi
  file=$(_pipros_file "$1" "$2") && ${EDITOR:-vim} "$file"
}

roscat() {
  local file
  if [ $# -ne 2 ]; then
    _pipros_usage "roscat [package] [file]" "Display a file content within a package." "$1"
    return
  fi
  file=$(_pipros_file "$1" "$2") && cat "$file"
}

roscp() {
  local file
  if [ $# -ne 3 ]; then
    _pipros_usage "roscp package filename target" "Copy a file from a package to target location." --help
    return
  fi
  file=$(_pipros_file "$1" "$2") && cp "$file" "$3"
}

rosmv() {
  local file
  if [ $# -ne 3 ]; then
    _pipros_usage "rosmv package filename target" "Move a file from a package to target location." --help
  elif [ "$1" = -d ]; then
    if ! file=$(_pipros_place "$2" rosmv); then
      echo "$file"
      return 1
    fi
    mv "$file" "$3"
  else
    file=$(_pipros_file "$1" "$2") && mv "$file" "$3"
  fi
}

# Explain the absence of some commands, such as gazebo. The previous handler, which many distributions define,
# handles all other unknown commands. This applies only to interactive shells; scripts get the usual errors.
if [[ $- == *i* && $(declare -f command_not_found_handle) != *pipros-complete* ]]; then
  if declare -F command_not_found_handle > /dev/null; then
    eval "_pipros_former_$(declare -f command_not_found_handle)"
  fi
  command_not_found_handle() {
    case $1 in
      catkin | gazebo | gzclient | gzserver) pipros-complete --absent "$1" ;;
      *)
        if declare -F _pipros_former_command_not_found_handle > /dev/null; then
          _pipros_former_command_not_found_handle "$@"
        else
          echo "bash: $1: command not found" >&2
          return 127
        fi
        ;;
    esac
  }
fi

_pipros_complete() {
  local offers
  offers=$(pipros-complete "$COMP_CWORD" "${COMP_WORDS[@]}" 2> /dev/null)
  if [[ $offers == $'\x1f'* ]]; then  # a single candidate of several lines: a message template
    COMPREPLY=("${offers#?}")
    return
  fi
  mapfile -t COMPREPLY < <(printf '%s' "$offers")
  [ ${#COMPREPLY[@]} -gt 0 ] || return
  case "${COMPREPLY[0]}" in */ | *:=) compopt -o nospace ;; esac
  mapfile -t COMPREPLY < <(printf '%q\n' "${COMPREPLY[@]}")  # quoted, so that the shell does not expand names
}

complete -F _pipros_complete -o default roscd rospd rosls rosed roscat roscp rosmv rosrun roslaunch rostest rospack
complete -F _pipros_complete -o default rostopic rosnode rosparam rosservice rosmsg rossrv rosaction rosbag
complete -F _pipros_complete -o default roscore rosclean rosversion catkin_make catkin_make_isolated catkin_find catkin_topological_order catkin_create_pkg catkin_test_results
complete -F _pipros_complete -o default rosconsole rosdep rosstack pipros
