# The shell functions of ROS for fish: roscd, rosls, rosed, roscat, roscp, and completion.

function _pipros_place  # package[/path] -> path
    set -l parts (string split -m 1 / -- $argv[1])
    set -l folder (rospack find $parts[1]); or return 1
    if test (count $parts) -eq 1
        echo $folder
    else
        echo $folder/$parts[2]
    end
end

function _pipros_file  # package file -> the first file of that name
    set -l found (pipros-complete --find $argv[1] $argv[2])
    if test (count $found) -eq 0
        echo "That file does not exist in that package." >&2
        return 1
    end
    echo $found[1]
end

function roscd
    if test (count $argv) -eq 0
        cd (string split : -- $CMAKE_PREFIX_PATH)[1]
        return
    end
    set -l place (_pipros_place $argv[1]); and cd $place
end

function rosls
    set -l place (_pipros_place $argv[1]); and ls $argv[2..-1] $place
end

function rosed
    set -l file (_pipros_file $argv[1] $argv[2]); and eval $EDITOR (string escape -- $file)
end

function roscat
    set -l file (_pipros_file $argv[1] $argv[2]); and cat $file
end

function roscp
    set -l file (_pipros_file $argv[1] $argv[2]); and cp $file $argv[3]
end

function _pipros_complete
    set -l words (commandline -opc) (commandline -ct)
    pipros-complete (math (count $words) - 1) $words 2>/dev/null
end

for command in roscd rosls rosed roscat roscp rosrun roslaunch rostest rospack rostopic rosnode rosparam rosservice rosmsg rossrv
    complete -c $command -a '(_pipros_complete)'
end
