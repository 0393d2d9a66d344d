# The shell functions of ROS for zsh: roscd, rosls, rosed, roscat, roscp, rospd, and completion.

_pipros_place() {  # package[/path] -> path
  local package=${1%%/*} folder
  folder=$(rospack find "$package") || return 1
  if [[ $package == $1 ]]; then echo $folder; else echo $folder/${1#*/}; fi
}

_pipros_file() {  # package file -> the one file of that name
  local choice
  local -a found=(${(f)"$(pipros-complete --find $1 $2)"})
  case ${#found} in
    0) echo "That file does not exist in that package." >&2; return 1 ;;
    1) echo ${found[1]} ;;
    *) echo "You have chosen a non-unique filename, please pick one of the following:" >&2
       select choice in $found; do echo $choice; break; done ;;
  esac
}

roscd() {
  local place
  if (( $# == 0 )); then
    place=${CMAKE_PREFIX_PATH%%:*}
    [[ -n $place ]] && cd $place
    return
  fi
  if [[ $1 == log ]]; then cd ${ROS_LOG_DIR:-${ROS_HOME:-$HOME/.ros}/log}/latest; return; fi
  place=$(_pipros_place $1) && cd $place
}

rospd() { local place; place=$(_pipros_place $1) && pushd $place }
rosls() { local place; place=$(_pipros_place ${1:?a package, please}) && shift && ls "$@" $place }
rosed() { local file; file=$(_pipros_file $1 $2) && ${=EDITOR:-vim} $file }
roscat() { local file; file=$(_pipros_file $1 $2) && cat $file }
roscp() { local file; file=$(_pipros_file $1 $2) && cp $file ${3:?a destination, please} }

_pipros_complete() {
  local -a candidates=(${(f)"$(pipros-complete $((CURRENT - 1)) $words 2> /dev/null)"})
  compadd -S '' -- ${(M)candidates:#*/}
  compadd -- ${candidates:#*/}
}

if (( $+functions[compdef] )); then
  compdef _pipros_complete roscd rospd rosls rosed roscat roscp rosrun roslaunch rostest rospack \
    rostopic rosnode rosparam rosservice rosmsg rossrv
fi
