"""Messages of opencv_apps, made from their definitions by `pipros stubs`."""

from pipros.msg import base as _base
import std_msgs.msg

class Circle(_base.Message):
    """A circle in an image."""
    center: Point2D
    """its centre, pixels"""
    radius: float
    """pixels"""
    def __init__(self, center: Point2D | None = ..., radius: float | None = ...) -> None: ...

class CircleArray(_base.Message):
    """The circles found in an image."""
    circles: list[Circle]
    """any number"""
    def __init__(self, circles: list[Circle] | None = ...) -> None: ...

class CircleArrayStamped(_base.Message):
    """The circles found in an image, with its header."""
    header: std_msgs.msg.Header
    """the header of the image"""
    circles: list[Circle]
    """any number"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., circles: list[Circle] | None = ...) -> None: ...

class Contour(_base.Message):
    """A closed outline in an image."""
    points: list[Point2D]
    """its corners in order, pixels"""
    def __init__(self, points: list[Point2D] | None = ...) -> None: ...

class ContourArray(_base.Message):
    """The outlines found in an image."""
    contours: list[Contour]
    """any number"""
    def __init__(self, contours: list[Contour] | None = ...) -> None: ...

class ContourArrayStamped(_base.Message):
    """The outlines found in an image, with its header."""
    header: std_msgs.msg.Header
    """the header of the image"""
    contours: list[Contour]
    """any number"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., contours: list[Contour] | None = ...) -> None: ...

class Face(_base.Message):
    """A face in an image."""
    face: Rect
    """the whole face, pixels"""
    eyes: list[Rect]
    """the eyes in it, pixels; may be empty"""
    label: str
    """the person, if recognized; otherwise empty"""
    confidence: float
    """confidence of the recognition, on the scale of the method"""
    def __init__(self, face: Rect | None = ..., eyes: list[Rect] | None = ..., label: str | None = ..., confidence: float | None = ...) -> None: ...

class FaceArray(_base.Message):
    """The faces found in an image."""
    faces: list[Face]
    """any number"""
    def __init__(self, faces: list[Face] | None = ...) -> None: ...

class FaceArrayStamped(_base.Message):
    """The faces found in an image, with its header."""
    header: std_msgs.msg.Header
    """the header of the image"""
    faces: list[Face]
    """any number"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., faces: list[Face] | None = ...) -> None: ...

class Flow(_base.Message):
    """The motion of a point from one image to the next."""
    point: Point2D
    """position, pixels"""
    velocity: Point2D
    """displacement per image, pixels"""
    def __init__(self, point: Point2D | None = ..., velocity: Point2D | None = ...) -> None: ...

class FlowArray(_base.Message):
    """How the points of an image move."""
    flow: list[Flow]
    """one for each point"""
    def __init__(self, flow: list[Flow] | None = ...) -> None: ...

class FlowArrayStamped(_base.Message):
    """How the points of an image move, with its header."""
    header: std_msgs.msg.Header
    """the header of the image"""
    flow: list[Flow]
    """one for each point"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., flow: list[Flow] | None = ...) -> None: ...

class FlowStamped(_base.Message):
    """How one point of an image moves, with its header."""
    header: std_msgs.msg.Header
    """the header of the image"""
    flow: Flow
    """the point and its motion"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., flow: Flow | None = ...) -> None: ...

class Line(_base.Message):
    """A straight line from point to point in an image."""
    pt1: Point2D
    """one end, pixels"""
    pt2: Point2D
    """other end, pixels"""
    def __init__(self, pt1: Point2D | None = ..., pt2: Point2D | None = ...) -> None: ...

class LineArray(_base.Message):
    """The straight lines found in an image."""
    lines: list[Line]
    """any number"""
    def __init__(self, lines: list[Line] | None = ...) -> None: ...

class LineArrayStamped(_base.Message):
    """The straight lines found in an image, with its header."""
    header: std_msgs.msg.Header
    """the header of the image"""
    lines: list[Line]
    """any number"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., lines: list[Line] | None = ...) -> None: ...

class Moment(_base.Message):
    """Image moments of an outline: m are sums of powers of x and y in pixels (m21 of x^2 y), mu the same about the
    centre of mass, nu these made independent of size."""
    m00: float
    """moment of order 0, the area"""
    m10: float
    """moment of x"""
    m01: float
    """moment of y"""
    m20: float
    """moment of x^2"""
    m11: float
    """moment of x y"""
    m02: float
    """moment of y^2"""
    m30: float
    """moment of x^3"""
    m21: float
    """moment of x^2 y"""
    m12: float
    """moment of x y^2"""
    m03: float
    """moment of y^3"""
    mu20: float
    """central moment of x^2"""
    mu11: float
    """central moment of x y"""
    mu02: float
    """central moment of y^2"""
    mu30: float
    """central moment of x^3"""
    mu21: float
    """central moment of x^2 y"""
    mu12: float
    """central moment of x y^2"""
    mu03: float
    """central moment of y^3"""
    nu20: float
    """normalized central moment of x^2"""
    nu11: float
    """normalized central moment of x y"""
    nu02: float
    """normalized central moment of y^2"""
    nu30: float
    """normalized central moment of x^3"""
    nu21: float
    """normalized central moment of x^2 y"""
    nu12: float
    """normalized central moment of x y^2"""
    nu03: float
    """normalized central moment of y^3"""
    center: Point2D
    """centre of mass, pixels"""
    length: float
    """length of the outline, pixels"""
    area: float
    """area inside the outline, pixels squared"""
    def __init__(self, m00: float | None = ..., m10: float | None = ..., m01: float | None = ..., m20: float | None = ..., m11: float | None = ..., m02: float | None = ..., m30: float | None = ..., m21: float | None = ..., m12: float | None = ..., m03: float | None = ..., mu20: float | None = ..., mu11: float | None = ..., mu02: float | None = ..., mu30: float | None = ..., mu21: float | None = ..., mu12: float | None = ..., mu03: float | None = ..., nu20: float | None = ..., nu11: float | None = ..., nu02: float | None = ..., nu30: float | None = ..., nu21: float | None = ..., nu12: float | None = ..., nu03: float | None = ..., center: Point2D | None = ..., length: float | None = ..., area: float | None = ...) -> None: ...

class MomentArray(_base.Message):
    """Moments of the outlines in an image."""
    moments: list[Moment]
    """one for each outline"""
    def __init__(self, moments: list[Moment] | None = ...) -> None: ...

class MomentArrayStamped(_base.Message):
    """Moments of the outlines in an image, with its header."""
    header: std_msgs.msg.Header
    """the header of the image"""
    moments: list[Moment]
    """one for each outline"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., moments: list[Moment] | None = ...) -> None: ...

class Point2D(_base.Message):
    """A point of an image, from the upper left corner."""
    x: float
    """to the right, pixels"""
    y: float
    """down, pixels"""
    def __init__(self, x: float | None = ..., y: float | None = ...) -> None: ...

class Point2DArray(_base.Message):
    """Points of an image, such as corners."""
    points: list[Point2D]
    """any number"""
    def __init__(self, points: list[Point2D] | None = ...) -> None: ...

class Point2DArrayStamped(_base.Message):
    """Points of an image, such as corners, with its header."""
    header: std_msgs.msg.Header
    """the header of the image"""
    points: list[Point2D]
    """any number"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., points: list[Point2D] | None = ...) -> None: ...

class Point2DStamped(_base.Message):
    """A point of an image, with its header."""
    header: std_msgs.msg.Header
    """the header of the image"""
    point: Point2D
    """the point"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., point: Point2D | None = ...) -> None: ...

class Rect(_base.Message):
    """An upright rectangle in an image. Whether x and y are its centre, as for faces, or its upper left corner
    depends on the node."""
    x: float
    """to the right, pixels"""
    y: float
    """down, pixels"""
    width: float
    """pixels"""
    height: float
    """pixels"""
    def __init__(self, x: float | None = ..., y: float | None = ..., width: float | None = ..., height: float | None = ...) -> None: ...

class RectArray(_base.Message):
    """Upright rectangles in an image, such as people that were found."""
    rects: list[Rect]
    """any number"""
    def __init__(self, rects: list[Rect] | None = ...) -> None: ...

class RectArrayStamped(_base.Message):
    """Upright rectangles in an image, such as people that were found, with its header."""
    header: std_msgs.msg.Header
    """the header of the image"""
    rects: list[Rect]
    """any number"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., rects: list[Rect] | None = ...) -> None: ...

class RotatedRect(_base.Message):
    """A rectangle in an image that may be turned."""
    angle: float
    """how it is turned, degrees, clockwise in the image"""
    center: Point2D
    """its centre, pixels"""
    size: Size
    """its extent before it is turned, pixels"""
    def __init__(self, angle: float | None = ..., center: Point2D | None = ..., size: Size | None = ...) -> None: ...

class RotatedRectArray(_base.Message):
    """Turned rectangles in an image."""
    rects: list[RotatedRect]
    """any number"""
    def __init__(self, rects: list[RotatedRect] | None = ...) -> None: ...

class RotatedRectArrayStamped(_base.Message):
    """Turned rectangles in an image, with its header."""
    header: std_msgs.msg.Header
    """the header of the image"""
    rects: list[RotatedRect]
    """any number"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., rects: list[RotatedRect] | None = ...) -> None: ...

class RotatedRectStamped(_base.Message):
    """A turned rectangle in an image, with its header."""
    header: std_msgs.msg.Header
    """the header of the image"""
    rect: RotatedRect
    """the rectangle"""
    def __init__(self, header: std_msgs.msg.Header | None = ..., rect: RotatedRect | None = ...) -> None: ...

class Size(_base.Message):
    """Extent of something in an image."""
    width: float
    """pixels"""
    height: float
    """pixels"""
    def __init__(self, width: float | None = ..., height: float | None = ...) -> None: ...
