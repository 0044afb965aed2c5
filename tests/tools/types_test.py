# SPDX-License-Identifier: Apache-2.0
"""`rowe types`: declarations of what the demo robot publishes and provides."""
import json
import pathlib
import re
import shutil
import subprocess
import unittest

from program import hub, run

root = pathlib.Path(__file__).resolve().parents[2]


def programs_own(names):
    return {name for name in names if not name.startswith(("/rowe/", "/rosapi/"))}


class types(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.demo = cls.enterClassContext(hub("--demo"))

    def said(self, *options, code=0):
        done = run("types", f"ws://127.0.0.1:{self.demo.port}", *options, code=code)
        return "\n".join(done.stdout), "\n".join(done.stderr)

    def test_are_declared_for_typescript(self):
        text, _ = self.said()
        for part in ("export namespace nav_msgs {\n  export interface Odometry {",
                     "    pose: geometry_msgs.PoseWithCovariance;\n", "    /** 36 elements */\n",
                     "export interface robot_set_speed_request {\n  speed: number;\n}",
                     "export interface robot_set_speed_answer {\n  speed: number;\n}",
                     'export interface topics {\n', '  "/odom": nav_msgs.Odometry;\n',
                     '  "/rowe/stats": rowe.Stats;\n',
                     "export namespace rowe {\n  export interface Stats {\n",
                     "  \"/robot/set_speed\": { "
                     "request: robot_set_speed_request; response: robot_set_speed_answer };\n",
                     '  "/rosapi/topics": { request: '):
            self.assertIn(part, text)

    def test_are_typescript_by_name_too(self):
        self.assertEqual(self.said("--ts"), self.said())

    def test_are_one_schema_for_each_name(self):
        schemas = json.loads(self.said("--json-schema")[0])
        odom = schemas["topics"]["/odom"]
        self.assertEqual(programs_own(schemas["topics"]), {"/cmd_vel", "/odom"})
        self.assertEqual(programs_own(schemas["services"]), {"/robot/set_speed"})
        stats = schemas["topics"]["/rowe/stats"]
        self.assertEqual((stats["title"], stats["properties"]["losses"]["properties"]["full"]["type"]),
                         ("rowe/Stats", "integer"))
        speed = schemas["services"]["/robot/set_speed"]
        self.assertEqual((set(speed), speed["request"]["required"]), ({"request", "response"}, ["speed"]))
        self.assertEqual(odom["title"], "nav_msgs/Odometry")
        covariance = odom["properties"]["pose"]["properties"]["covariance"]
        self.assertEqual((covariance["minItems"], covariance["maxItems"]), (36, 36))

    def test_are_text_of_ros_where_ros_has_them(self):
        text, why = self.said("--ros", code=1)
        self.assertIn("# /odom is nav_msgs/Odometry\nstd_msgs/Header header\nstring child_frame_id\n", text)
        self.assertIn("MSG: geometry_msgs/PoseWithCovariance\ngeometry_msgs/Pose pose\nfloat64[36] cov", text)
        self.assertIn("/robot/set_speed request: the type has no name", why)
        self.assertNotIn("/rosapi", why)

    def test_are_structs_of_c(self):
        header, _ = self.said("--c")
        for part in ("#include <rowe/struct.h>\n",
                     "struct nav_msgs_Odometry {\n  struct std_msgs_Header header;\n",
                     "    ROWE_INSIDE(struct nav_msgs_Odometry, header, &std_msgs_Header_type),\n",
                     "struct robot_set_speed_request {\n  double speed;\n};\n",
                     "  double covariance[36];\n"):
            self.assertIn(part, header)
        types = re.findall(r"static const struct rowe_struct (\w+) = ", header)
        self.assertGreater(len(types), 30)  # the endpoint's own, too
        counts = " + ".join(f"{one}.count" for one in types)
        self.compile_as_c(header + f"\nint main(void) {{ return (int)({counts}) == 0; }}\n")

    def compile_as_c(self, text):
        warnings = ("-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror")
        for compiler in filter(shutil.which, ("gcc", "clang")):
            for version in ("c99", "c11", "c2x"):
                how = [compiler, f"-std={version}", *warnings, f"-I{root}/include", "-fsyntax-only"]
                done = subprocess.run([*how, "-xc", "-"], input=text, text=True, capture_output=True,
                                      check=False)
                self.assertEqual(done.returncode, 0, done.stderr[:4000])

    def test_of_a_hub_without_handles_are_its_own(self):
        with hub() as empty:
            done = run("types", f"ws://127.0.0.1:{empty.port}", "--json-schema", code=0)
            schemas = json.loads("".join(done.stdout))
            self.assertEqual([programs_own(schemas[part]) for part in ("topics", "services")], [set(), set()])
            self.assertEqual(run("types", f"ws://127.0.0.1:{empty.port}", "--ros").code, 0)

    def test_need_one_form_and_somebody_who_answers(self):
        for form in ("--json-schema", "--ts"):
            run("types", "127.0.0.1:1", "--ros", form, code=2, first="choose one")


if __name__ == "__main__":
    unittest.main()
