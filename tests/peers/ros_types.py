# SPDX-License-Identifier: Apache-2.0
"""The ROS messages that fake_rosbridge knows: filled from JSON and written as JSON, as rosbridge does it.

A type is a dict of its fields; a field's type is a primitive, another type, or either with [N].
"""
import math
import time

types = {
    "std_msgs/Header": {"seq": "uint32", "stamp": "time", "frame_id": "string"},
    "std_msgs/Bool": {"data": "bool"},
    "std_msgs/String": {"data": "string"},
    "std_msgs/Int64": {"data": "int64"},
    "std_msgs/Float64": {"data": "float64"},
    "geometry_msgs/Point": {"x": "float64", "y": "float64", "z": "float64"},
    "geometry_msgs/Vector3": {"x": "float64", "y": "float64", "z": "float64"},
    "geometry_msgs/Quaternion": {"x": "float64", "y": "float64", "z": "float64", "w": "float64"},
    "geometry_msgs/Pose": {"position": "geometry_msgs/Point", "orientation": "geometry_msgs/Quaternion"},
    "geometry_msgs/Twist": {"linear": "geometry_msgs/Vector3", "angular": "geometry_msgs/Vector3"},
    "geometry_msgs/PoseWithCovariance": {"pose": "geometry_msgs/Pose", "covariance": "float64[36]"},
    "geometry_msgs/TwistWithCovariance": {"twist": "geometry_msgs/Twist", "covariance": "float64[36]"},
    "nav_msgs/Odometry": {"header": "std_msgs/Header", "child_frame_id": "string",
                          "pose": "geometry_msgs/PoseWithCovariance",
                          "twist": "geometry_msgs/TwistWithCovariance"},
    "rospy_tutorials/AddTwoIntsRequest": {"a": "int64", "b": "int64"},
    "rospy_tutorials/AddTwoIntsResponse": {"sum": "int64"},
    "std_srvs/SetBoolRequest": {"data": "bool"},
    "std_srvs/SetBoolResponse": {"success": "bool", "message": "string"},
    "std_srvs/TriggerRequest": {},
    "std_srvs/TriggerResponse": {"success": "bool", "message": "string"},
}

_ranges = {f"{sign}int{bits}": (0 if sign else -(1 << bits - 1), (1 << bits - (not sign)) - 1)
           for bits in (8, 16, 32, 64) for sign in ("", "u")}


class misfit(Exception):
    """A value that is none of the field's type."""


def known(name):
    """The type's name without needless slashes; None for a type that is not known, such as all of ROS 2."""
    plain_name = "/".join(part for part in str(name).split("/") if part)
    return plain_name if plain_name in types else None


def array_of(kind):
    """("float64", 36) of "float64[36]"; None of what is no array."""
    if not kind.endswith("]"):
        return None
    element, count = kind[:-1].split("[")
    return element, int(count)


def filled(kind, value=None):
    """`value` as a whole message: what is missing takes its default. Raises misfit."""
    array = array_of(kind)
    if array:
        return filled_array(*array, value)
    if kind in types:
        return filled_message(kind, {} if value is None else value)
    if kind == "time":
        parts = {} if value is None else value
        if not isinstance(parts, dict):
            raise misfit(kind)
        return {name: filled("uint32", parts.get(name)) for name in ("secs", "nsecs")}
    if value is None:
        return {"string": "", "bool": False}.get(kind, 0.0 if kind == "float64" else 0)
    return checked(kind, value)


def filled_message(kind, value):
    fields = types[kind]
    if not isinstance(value, dict) or not set(value) <= set(fields) or None in value.values():
        raise misfit(f"{kind}: {value!r}")
    if kind == "std_msgs/Header" and "stamp" not in value:
        now = time.time_ns()
        value = {**value, "stamp": {"secs": now // 10**9, "nsecs": now % 10**9}}
    return {name: filled(field, value.get(name)) for name, field in fields.items()}


def filled_array(element, count, value):
    if value is None:
        value = [None] * count
    if not isinstance(value, list) or len(value) != count:
        raise misfit(f"{element}[{count}]: {value!r}")
    return [filled(element, one) for one in value]


def checked(kind, value):
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if kind == "string" and isinstance(value, str) or kind == "bool" and isinstance(value, bool):
        return value
    if kind == "float64" and number:
        return float(value)
    least, most = _ranges.get(kind, (1, 0))
    if number and isinstance(value, int) and least <= value <= most:
        return value
    raise misfit(f"{kind}: {value!r}")


def plain(kind, value):
    """A whole message as rosbridge's JSON has it: no NaN, no infinity."""
    array = array_of(kind)
    if array:
        return [plain(array[0], one) for one in value]
    if kind in types:
        return {name: plain(field, value[name]) for name, field in types[kind].items()}
    return None if isinstance(value, float) and not math.isfinite(value) else value
