// SPDX-License-Identifier: Apache-2.0
// As `rowe types` prints it, cut down to what typed.ts uses.

export namespace geometry_msgs {
  export interface Vector3 {
    x: number;
    y: number;
    z: number;
  }

  export interface Twist {
    linear: geometry_msgs.Vector3;
    angular: geometry_msgs.Vector3;
  }
}

export interface odometry {
  pose: { pose: { position: geometry_msgs.Vector3 } };
}

export interface topics {
  "/odom": odometry;
  "/cmd_vel": geometry_msgs.Twist;
}

export interface services {
  "/robot/set_speed": { request: { speed: number }; response: { speed: number } };
}
