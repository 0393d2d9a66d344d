"""Messages of visualization_msgs, made from their definitions by `pipros stubs`."""

from typing import Final as _Final
from pipros.msg import base as _base
from pipros.msg import time as _time
import geometry_msgs.msg
import std_msgs.msg

class ImageMarker(_base.Message):
    """A shape to draw on an image. Coordinates are pixels: x to the right, y down, from the upper left corner."""
    CIRCLE: _Final = 0
    """a circle about position"""
    LINE_STRIP: _Final = 1
    """a line through all points"""
    LINE_LIST: _Final = 2
    """a line for each pair of points"""
    POLYGON: _Final = 3
    """a closed line through all points"""
    POINTS: _Final = 4
    """a dot at each point"""
    ADD: _Final = 0
    """add or change it"""
    REMOVE: _Final = 1
    """remove it"""
    header: std_msgs.msg.Header
    """the header of the image on which to draw"""
    ns: str
    """namespace; ns and id together name the marker"""
    id: int
    """number within the namespace; a marker with the same number is changed"""
    type: int
    """CIRCLE to POINTS"""
    action: int
    """ADD or REMOVE"""
    position: geometry_msgs.msg.Point
    """centre of a circle, pixels; z is not used"""
    scale: float
    """diameter of a circle, width of a line or size of a dot, pixels"""
    outline_color: std_msgs.msg.ColorRGBA
    """of lines and dots"""
    filled: int
    """1: fill circles and polygons"""
    fill_color: std_msgs.msg.ColorRGBA
    """of the inside, if filled"""
    lifetime: _time.Duration
    """time after which the marker is removed; 0: never"""
    points: list[geometry_msgs.msg.Point]
    """for all types but CIRCLE, pixels; z is not used"""
    outline_colors: list[std_msgs.msg.ColorRGBA]
    """one for each point or line, instead of outline_color; may be empty"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., ns: str | None = ..., id: int | None = ..., type: int | None = ..., action: int | None = ..., position: geometry_msgs.msg.Point | None = ..., scale: float | None = ..., outline_color: std_msgs.msg.ColorRGBA | None = ..., filled: int | None = ..., fill_color: std_msgs.msg.ColorRGBA | None = ..., lifetime: _time.Duration | None = ..., points: list[geometry_msgs.msg.Point] | None = ..., outline_colors: list[std_msgs.msg.ColorRGBA] | None = ...) -> None: ...

class InteractiveMarker(_base.Message):
    """An object in rviz that users can move, turn and click. The library interactive_markers sends it."""
    header: std_msgs.msg.Header
    """frame_id: the frame of the pose; stamp 0: the marker follows the frame as it moves"""
    pose: geometry_msgs.msg.Pose
    """pose of the marker; controls are relative to it"""
    name: str
    """unique among the server's markers"""
    description: str
    """text that is shown above it; may be empty"""
    scale: float
    """size of the controls that are drawn by default, metres"""
    menu_entries: list[MenuEntry]
    """the menu of its right mouse button; may be empty"""
    controls: list[InteractiveMarkerControl]
    """the parts that can be grabbed or clicked"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., pose: geometry_msgs.msg.Pose | None = ..., name: str | None = ..., description: str | None = ..., scale: float | None = ..., menu_entries: list[MenuEntry] | None = ..., controls: list[InteractiveMarkerControl] | None = ...) -> None: ...

class InteractiveMarkerControl(_base.Message):
    """A part of an interactive marker that the mouse can grab or click."""
    INHERIT: _Final = 0
    """the axes turn with the marker"""
    FIXED: _Final = 1
    """the axes keep their direction in the frame when the marker is turned"""
    VIEW_FACING: _Final = 2
    """the x axis points at the viewer"""
    NONE: _Final = 0
    """only shown"""
    MENU: _Final = 1
    """a click opens the menu"""
    BUTTON: _Final = 2
    """a click is reported"""
    MOVE_AXIS: _Final = 3
    """moves along x"""
    MOVE_PLANE: _Final = 4
    """moves in the plane of y and z"""
    ROTATE_AXIS: _Final = 5
    """turns about x"""
    MOVE_ROTATE: _Final = 6
    """moves in the plane of y and z and turns about x"""
    MOVE_3D: _Final = 7
    """moves freely, by mouse and keys or a device for three dimensions"""
    ROTATE_3D: _Final = 8
    """turns freely"""
    MOVE_ROTATE_3D: _Final = 9
    """moves and turns freely"""
    name: str
    """unique among the marker's controls; repeated in feedback"""
    orientation: geometry_msgs.msg.Quaternion
    """Rotation of the control's axes relative to the marker's. Motions are along or about its x axis, or in the
    plane of y and z."""
    orientation_mode: int
    """INHERIT, FIXED or VIEW_FACING"""
    interaction_mode: int
    """NONE to MOVE_ROTATE_3D"""
    always_visible: bool
    """whether to show its markers even if nobody interacts with it"""
    markers: list[Marker]
    """its appearance; if empty, arrows or rings are drawn if the mode has them"""
    independent_marker_orientation: bool
    """with VIEW_FACING, true: the markers do not turn to the viewer"""
    description: str
    """a tooltip"""
    def __init__(self, name: str | None = ..., orientation: geometry_msgs.msg.Quaternion | None = ..., orientation_mode: int | None = ..., interaction_mode: int | None = ..., always_visible: bool | None = ..., markers: list[Marker] | None = ..., independent_marker_orientation: bool | None = ..., description: str | None = ...) -> None: ...

class InteractiveMarkerFeedback(_base.Message):
    """A user's action on an interactive marker. rviz publishes it on SERVER/feedback."""
    KEEP_ALIVE: _Final = 0
    """the mouse still holds the marker"""
    POSE_UPDATE: _Final = 1
    """the marker was moved or turned"""
    MENU_SELECT: _Final = 2
    """an entry of the menu was chosen"""
    BUTTON_CLICK: _Final = 3
    """a control of mode BUTTON was clicked"""
    MOUSE_DOWN: _Final = 4
    """the mouse button was pressed"""
    MOUSE_UP: _Final = 5
    """the mouse button was released"""
    header: std_msgs.msg.Header
    """frame_id: the frame of pose and mouse_point"""
    client_id: str
    """the viewer that sent it"""
    marker_name: str
    """name of the marker"""
    control_name: str
    """name of the control; empty if none was involved"""
    event_type: int
    """KEEP_ALIVE to MOUSE_UP"""
    pose: geometry_msgs.msg.Pose
    """current pose of the marker"""
    menu_entry_id: int
    """the chosen entry, with MENU_SELECT"""
    mouse_point: geometry_msgs.msg.Point
    """where the mouse hit the marker, metres"""
    mouse_point_valid: bool
    """true if mouse_point is set"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., client_id: str | None = ..., marker_name: str | None = ..., control_name: str | None = ..., event_type: int | None = ..., pose: geometry_msgs.msg.Pose | None = ..., menu_entry_id: int | None = ..., mouse_point: geometry_msgs.msg.Point | None = ..., mouse_point_valid: bool | None = ...) -> None: ...

class InteractiveMarkerInit(_base.Message):
    """All interactive markers of a server, for viewers that connect later; latched on SERVER/update_full."""
    server_id: str
    """the server, the same in all of its messages"""
    seq_num: int
    """number of the last InteractiveMarkerUpdate that is included"""
    markers: list[InteractiveMarker]
    """all of them"""
    def __init__(self, server_id: str | None = ..., seq_num: int | None = ..., markers: list[InteractiveMarker] | None = ...) -> None: ...

class InteractiveMarkerPose(_base.Message):
    """A new pose of an interactive marker that is otherwise unchanged."""
    header: std_msgs.msg.Header
    """frame_id: the frame of the pose; stamp 0: the marker follows the frame as it moves"""
    pose: geometry_msgs.msg.Pose
    """the new pose"""
    name: str
    """name of the marker"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., pose: geometry_msgs.msg.Pose | None = ..., name: str | None = ...) -> None: ...

class InteractiveMarkerUpdate(_base.Message):
    """Changes to the interactive markers of a server; on SERVER/update."""
    KEEP_ALIVE: _Final = 0
    """nothing changed"""
    UPDATE: _Final = 1
    """the lists below contain the changes"""
    server_id: str
    """the server, the same in all of its messages"""
    seq_num: int
    """increases by 1 with each UPDATE; KEEP_ALIVE repeats the last number, to detect losses"""
    type: int
    """KEEP_ALIVE or UPDATE"""
    markers: list[InteractiveMarker]
    """new markers, and markers with changes other than the pose"""
    poses: list[InteractiveMarkerPose]
    """markers that only moved"""
    erases: list[str]
    """names of the removed markers"""
    def __init__(self, server_id: str | None = ..., seq_num: int | None = ..., type: int | None = ..., markers: list[InteractiveMarker] | None = ..., poses: list[InteractiveMarkerPose] | None = ..., erases: list[str] | None = ...) -> None: ...

class Marker(_base.Message):
    """An object for rviz to draw; usually on visualization_marker. Lengths are in metres. A new message is
    invisible: set color.a and all of scale above 0, and pose.orientation.w to 1."""
    ARROW: _Final = 0
    """along x of the pose, or from points[0] to points[1]"""
    CUBE: _Final = 1
    """a box about the pose, scale gives its edges"""
    SPHERE: _Final = 2
    """a sphere about the pose, scale gives its diameters"""
    CYLINDER: _Final = 3
    """about z of the pose; scale.x and y are diameters, z is the height"""
    LINE_STRIP: _Final = 4
    """a line through points, scale.x wide"""
    LINE_LIST: _Final = 5
    """a line for each pair of points, scale.x wide"""
    CUBE_LIST: _Final = 6
    """a box at each point; faster than many markers"""
    SPHERE_LIST: _Final = 7
    """a sphere at each point"""
    POINTS: _Final = 8
    """a square at each point, scale.x wide and scale.y high"""
    TEXT_VIEW_FACING: _Final = 9
    """text that faces the viewer; scale.z is the height of a capital A"""
    MESH_RESOURCE: _Final = 10
    """the mesh of mesh_resource, scaled"""
    TRIANGLE_LIST: _Final = 11
    """a triangle for every three points"""
    ADD: _Final = 0
    """add the marker, or change the one with the same ns and id"""
    MODIFY: _Final = 0
    """the same as ADD"""
    DELETE: _Final = 2
    """delete the marker with the same ns and id"""
    DELETEALL: _Final = 3
    """delete all markers of the topic"""
    header: std_msgs.msg.Header
    """frame_id: the frame of the pose; stamp 0: the newest transform is used"""
    ns: str
    """namespace, which rviz can hide; ns and id together name the marker"""
    id: int
    """number within the namespace"""
    type: int
    """ARROW to TRIANGLE_LIST"""
    action: int
    """ADD, DELETE or DELETEALL"""
    pose: geometry_msgs.msg.Pose
    """pose of the marker; points are relative to it"""
    scale: geometry_msgs.msg.Vector3
    """size along x, y and z, metres; see the types; 1 leaves a mesh as it is"""
    color: std_msgs.msg.ColorRGBA
    """of the whole marker, 0 to 1; also tints meshes"""
    lifetime: _time.Duration
    """time after which the marker is removed; 0: never"""
    frame_locked: bool
    """true: moves with its frame; false: stays where it was drawn"""
    points: list[geometry_msgs.msg.Point]
    """for arrows, lines, lists and triangles; metres, relative to pose"""
    colors: list[std_msgs.msg.ColorRGBA]
    """one for each of points, instead of color; may be empty"""
    text: str
    """for TEXT_VIEW_FACING"""
    mesh_resource: str
    """for MESH_RESOURCE: package://PACKAGE/FILE, file:// or http://"""
    mesh_use_embedded_materials: bool
    """true: the colours and textures of the mesh file are used"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., ns: str | None = ..., id: int | None = ..., type: int | None = ..., action: int | None = ..., pose: geometry_msgs.msg.Pose | None = ..., scale: geometry_msgs.msg.Vector3 | None = ..., color: std_msgs.msg.ColorRGBA | None = ..., lifetime: _time.Duration | None = ..., frame_locked: bool | None = ..., points: list[geometry_msgs.msg.Point] | None = ..., colors: list[std_msgs.msg.ColorRGBA] | None = ..., text: str | None = ..., mesh_resource: str | None = ..., mesh_use_embedded_materials: bool | None = ...) -> None: ...

class MarkerArray(_base.Message):
    """Many markers in one message; usually on visualization_marker_array. Markers from earlier messages stay."""
    markers: list[Marker]
    """processed in this order"""
    def __init__(self, markers: list[Marker] | None = ...) -> None: ...

class MenuEntry(_base.Message):
    """An entry in the menu of an interactive marker. Entries are in display order, and each
    parent precedes its children."""
    FEEDBACK: _Final = 0
    """report the choice in an InteractiveMarkerFeedback"""
    ROSRUN: _Final = 1
    """run command as arguments of rosrun"""
    ROSLAUNCH: _Final = 2
    """run command as arguments of roslaunch"""
    id: int
    """its number within the marker; not 0"""
    parent_id: int
    """the entry whose submenu it is in; 0: the menu itself"""
    title: str
    """the text that is shown"""
    command: str
    """what to run, for ROSRUN and ROSLAUNCH"""
    command_type: int
    """FEEDBACK, ROSRUN or ROSLAUNCH"""
    def __init__(self, id: int | None = ..., parent_id: int | None = ..., title: str | None = ..., command: str | None = ..., command_type: int | None = ...) -> None: ...
