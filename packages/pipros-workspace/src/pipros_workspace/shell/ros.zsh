# The shell functions of ROS for zsh: roscd, rospd, rosd, rosls, rosed, roscat, roscp, rosmv, and completion.

_pipros_place() {  # package[/path], or log[/path], command -> path
  local package=${1%%/*} folder
  if [[ $package == log ]]; then
    folder=$(roslaunch-logs) || folder=${ROS_LOG_DIR:-${ROS_HOME:-$HOME/.ros}/log}
  elif [[ -z $package ]] || ! folder=$(rospack -q find $package 2> /dev/null); then
    echo "$2: No such package/stack '$1'"
    pipros-complete --similar "$package" 2> /dev/null
    return 1
  fi
  if [[ $package == $1 ]]; then echo $folder; else echo $folder/${1#*/}; fi
}

_pipros_file() {  # package file -> path of the file, chosen by the user if several match
  local choice
  if ! rospack -q find $1 > /dev/null 2>&1; then
    echo "Couldn't find package [$1]" >&2
    pipros-complete --similar "$1" >&2 2> /dev/null
    return 1
  fi
  local -a found=(${(f)"$(pipros-complete --find $1 $2)"})
  case ${#found} in
    0) echo "That file does not exist in that package." >&2; return 1 ;;
    1) echo ${found[1]} ;;
    *) echo "You have chosen a non-unique filename, please pick one of the following:" >&2
       select choice in $found; do echo $choice; break; done ;;
  esac
}

_pipros_usage() {  # usage text option -> 0 for --help, otherwise 1
  printf 'usage: %s\n\n%s\n' $1 $2
  [[ $3 == --help ]]
}

roscd() {
  local place
  if (( $# > 1 )) || [[ $1 == --help ]]; then
    _pipros_usage "roscd package" "Jump to target package." --help
    return
  fi
  if (( $# == 0 )); then
    place=${ROS_WORKSPACE:-${CMAKE_PREFIX_PATH%%:*}}
    if [[ -z $ROS_WORKSPACE && ! -f $place/.catkin ]]; then
      echo "No workspace is set up: source its devel/setup.zsh, or set ROS_WORKSPACE, to use roscd without a package"
      return 1
    fi
  elif ! place=$(_pipros_place $1 roscd); then
    echo $place
    return 1
  fi
  cd $place
}

rosd() {
  local folder number=0
  dirs -l -p | while read -r folder; do
    echo "$number $folder"
    (( number += 1 ))
  done
}

rospd() {
  local place
  if [[ $1 == <-> ]]; then
    pushd -q +$1 || return
  elif place=$(_pipros_place $1 rospd); then
    pushd -q $place || return
  else
    echo $place
    return 1
  fi
  rosd
}

rosls() {
  local place
  if [[ $1 == --help || $# -eq 0 ]]; then
    _pipros_usage "rosls [package]" "Lists contents of a package directory." "$1"
    return
  fi
  if ! place=$(_pipros_place $1 rosls); then
    echo $place >&2
    return 1
  fi
  shift
  ls "$@" $place
}

rosed() {
  local file
  if (( $# != 2 )); then
    _pipros_usage "rosed [package] [file]" "Edit a file within a package." "$1"
    return
  fi
  file=$(_pipros_file $1 $2) && ${=EDITOR:-vim} $file
}

roscat() {
  local file
  if (( $# != 2 )); then
    _pipros_usage "roscat [package] [file]" "Display a file content within a package." "$1"
    return
  fi
  file=$(_pipros_file $1 $2) && cat $file
}

roscp() {
  local file
  if (( $# != 3 )); then
    _pipros_usage "roscp package filename target" "Copy a file from a package to target location." --help
    return
  fi
  file=$(_pipros_file $1 $2) && cp $file $3
}

rosmv() {
  local file
  if (( $# != 3 )); then
    _pipros_usage "rosmv package filename target" "Move a file from a package to target location." --help
  elif [[ $1 == -d ]]; then
    if ! file=$(_pipros_place $2 rosmv); then
      echo $file
      return 1
    fi
    mv $file $3
  else
    file=$(_pipros_file $1 $2) && mv $file $3
  fi
}

# Explain the absence of some commands, such as gazebo. The previous handler, which many distributions define,
# handles all other unknown commands. This applies only to interactive shells; scripts get the usual errors.
if [[ -o interactive && ${functions[command_not_found_handler]:-} != *pipros-complete* ]]; then
  if (( $+functions[command_not_found_handler] )); then
    functions[_pipros_former_command_not_found_handler]=$functions[command_not_found_handler]
  fi
  command_not_found_handler() {
    case $1 in
      catkin | gazebo | gzclient | gzserver) pipros-complete --absent $1 ;;
      *)
        if (( $+functions[_pipros_former_command_not_found_handler] )); then
          _pipros_former_command_not_found_handler "$@"
        else
          echo "zsh: command not found: $1" >&2
          return 127
        fi
        ;;
    esac
  }
fi

_pipros_complete() {
  local offers="$(pipros-complete $((CURRENT - 1)) $words 2> /dev/null)"
  if [[ $offers == $'\x1f'* ]]; then  # a single candidate of several lines: a message template
    compadd -Q -- ${offers#?}
    return
  fi
  local -a candidates=(${(f)offers})
  compadd -S '' -- ${(M)candidates:#*(/|:=)}
  compadd -- ${candidates:#*(/|:=)}
}

if (( $+functions[compdef] )); then
  compdef _pipros_complete roscd rospd rosls rosed roscat roscp rosmv rosrun roslaunch rostest rospack \
    rostopic rosnode rosparam rosservice rosmsg rossrv rosaction rosbag roscore rosclean rosversion \
    catkin_make catkin_make_isolated catkin_find catkin_topological_order catkin_create_pkg catkin_test_results rosconsole rosdep rosstack pipros
fi
