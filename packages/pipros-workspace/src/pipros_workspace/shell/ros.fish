# The shell functions of ROS for fish: roscd, rosls, rosed, roscat, roscp, rosmv, and completion.

function _pipros_place  # package[/path], or log[/path], command -> path
    set -l parts (string split -m 1 / -- $argv[1])
    set -l folder
    if test "$parts[1]" = log
        set folder (roslaunch-logs)
        if test -z "$folder"
            set folder $HOME/.ros/log
            set -q ROS_HOME; and set folder $ROS_HOME/log
            set -q ROS_LOG_DIR; and set folder $ROS_LOG_DIR
        end
    else
        set folder (rospack -q find "$parts[1]" 2>/dev/null)
    end
    if test -z "$folder"
        echo "$argv[2]: No such package/stack '$argv[1]'" >&2
        pipros-complete --similar "$parts[1]" >&2 2>/dev/null
        return 1
    end
    if test (count $parts) -eq 1
        echo $folder
    else
        echo $folder/$parts[2]
    end
end

function _pipros_file  # package file -> path of the file, in $_pipros_found; asks if several match
    if not rospack -q find "$argv[1]" >/dev/null 2>&1
        echo "Couldn't find package [$argv[1]]" >&2
        pipros-complete --similar "$argv[1]" >&2 2>/dev/null
        return 1
    end
    set -g _pipros_found (pipros-complete --find $argv[1] $argv[2])
    if test (count $_pipros_found) -eq 0
        echo "That file does not exist in that package." >&2
        return 1
    end
    if test (count $_pipros_found) -gt 1
        echo "You have chosen a non-unique filename, please pick one of the following:" >&2
        for number in (seq (count $_pipros_found))
            echo "$number) $_pipros_found[$number]" >&2
        end
        # A command substitution could not read the user's input.
        read -l -P '#? ' choice; or return 1
        set -g _pipros_found $_pipros_found[$choice]
    end
end

function _pipros_usage  # usage text option -> 0 for --help, otherwise 1
    printf 'usage: %s\n\n%s\n' $argv[1] $argv[2]
    test "$argv[3]" = --help
end

function roscd
    if test (count $argv) -gt 1 -o "$argv[1]" = --help
        _pipros_usage "roscd package" "Jump to target package." --help
        return
    end
    if test (count $argv) -eq 0
        set -l place $ROS_WORKSPACE (string split : -- $CMAKE_PREFIX_PATH)
        if test -z "$ROS_WORKSPACE" -a ! -f "$place[1]/.catkin"
            echo "No workspace is set up: source its devel/setup.fish, or set ROS_WORKSPACE, to use roscd without a package"
            return 1
        end
        cd $place[1]
    else
        set -l place (_pipros_place $argv[1] roscd); and cd $place
    end
end

function rosls
    if test (count $argv) -eq 0 -o "$argv[1]" = --help
        _pipros_usage "rosls [package]" "Lists contents of a package directory." "$argv[1]"
        return
    end
    set -l place (_pipros_place $argv[1] rosls); and ls $argv[2..-1] $place
end

function rosed
    if test (count $argv) -ne 2
        _pipros_usage "rosed [package] [file]" "Edit a file within a package." "$argv[1]"
        return
    end
    set -l editor vim
    set -q EDITOR; and set editor (string split ' ' -- $EDITOR)
    _pipros_file $argv[1] $argv[2]; and $editor $_pipros_found
end

function roscat
    if test (count $argv) -ne 2
        _pipros_usage "roscat [package] [file]" "Display a file content within a package." "$argv[1]"
        return
    end
    _pipros_file $argv[1] $argv[2]; and cat $_pipros_found
end

function roscp
    if test (count $argv) -ne 3
        _pipros_usage "roscp package filename target" "Copy a file from a package to target location." --help
        return
    end
    _pipros_file $argv[1] $argv[2]; and cp $_pipros_found $argv[3]
end

function rosmv
    if test (count $argv) -ne 3
        _pipros_usage "rosmv package filename target" "Move a file from a package to target location." --help
    else if test "$argv[1]" = -d
        set -l place (_pipros_place $argv[2] rosmv); and mv $place $argv[3]
    else
        _pipros_file $argv[1] $argv[2]; and mv $_pipros_found $argv[3]
    end
end

# Explain the absence of some commands, such as gazebo. The previous handler handles all other unknown
# commands. This applies only to interactive shells; scripts get the usual errors.
if status is-interactive; and not functions -q _pipros_former_command_not_found
    if functions -q fish_command_not_found
        functions -c fish_command_not_found _pipros_former_command_not_found
    else
        function _pipros_former_command_not_found
            __fish_default_command_not_found_handler $argv
        end
    end
    function fish_command_not_found
        switch $argv[1]
            case catkin gazebo gzclient gzserver
                pipros-complete --absent $argv[1]
            case '*'
                _pipros_former_command_not_found $argv
        end
    end
end

function _pipros_complete
    set -l words (commandline -opc) (commandline -ct)
    pipros-complete (math (count $words) - 1) $words 2>/dev/null | string replace \x1f ''
end

for command in roscd rosls rosed roscat roscp rosmv rosrun roslaunch rostest rospack rostopic rosnode rosparam \
        rosservice rosmsg rossrv rosaction rosbag roscore rosclean rosversion catkin_make catkin_make_isolated catkin_find catkin_topological_order catkin_create_pkg \
        rosconsole rosdep rosstack pipros
    complete -c $command -a '(_pipros_complete)'
end
