#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A node of ROS as anybody would write it, with rospy: says each second what is hard to hand on, provides two
services, one of which never answers, and prints what it hears of /cmd_vel and of /picture. `node.py NAME
PREFIX` has services below PREFIX only, and withdraws the one that never answers when it is told to."""
import base64
import sys
import threading

import rospy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from std_msgs.msg import Float64MultiArray, Int64, String, UInt8MultiArray
from std_srvs.srv import SetBool, SetBoolResponse, Trigger, TriggerResponse


def hang(_):
    say("hanging")
    threading.Event().wait()


def say(*words):
    print(*words, flush=True)


def trigger(act):
    act()
    return TriggerResponse(True, "")


if len(sys.argv) > 2:
    rospy.init_node(sys.argv[1])
    prefix = sys.argv[2]
    hanging = rospy.Service(prefix + "/hang", Trigger, hang)
    # What is shut down waits for its calls: the master alone is told.
    forget = rospy.get_master().unregisterService
    rospy.Service(prefix + "/withdraw", Trigger,
                  lambda _: trigger(lambda: forget(prefix + "/hang", hanging.uri)))
    rospy.Service(prefix + "/offer", Trigger, lambda _: trigger(
        lambda: rospy.Service(prefix + "/new", Trigger, lambda _: TriggerResponse(True, ""))))
    say("ready")
    rospy.spin()
    sys.exit()

rospy.init_node("tested")
said = [(rospy.Publisher("/hard/int64", Int64, queue_size=1), Int64(-9223372036854775807)),
        (rospy.Publisher("/hard/floats", Float64MultiArray, queue_size=1),
         Float64MultiArray(data=[float("nan"), float("inf"), 0.1])),
        (rospy.Publisher("/hard/bytes", UInt8MultiArray, queue_size=1), UInt8MultiArray(data=b"\0\xff")),
        (rospy.Publisher("/hard/large", String, queue_size=1), String("x" * 100000)),
        (rospy.Publisher("/hard/odom", Odometry, queue_size=1), Odometry(child_frame_id="base"))]
kept = rospy.Publisher("/hard/kept", String, queue_size=1, latch=True)
kept.publish(String("since long"))
rospy.Service("/set", SetBool, lambda call: SetBoolResponse(True, f"set to {call.data}"))
rospy.Service("/hang", Trigger, hang)
rospy.Subscriber("/cmd_vel", Twist, lambda m: say("cmd_vel", m.linear.x, m.linear.y, m.angular.z))
rospy.Subscriber("/picture", UInt8MultiArray, lambda m: say("picture", base64.b64encode(m.data).decode()))
say("ready")
while not rospy.is_shutdown():
    for publisher, message in said:
        publisher.publish(message)
    rospy.rostime.wallsleep(0.1)
