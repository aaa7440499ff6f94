"""test_dxf.py BIELLE: plates in DXF, read back by ezdxf, have the distances of the robot. Without ezdxf: status 77."""
import itertools
import math
import os
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree

BIELLE = os.path.abspath(sys.argv.pop(1))
try:
    import ezdxf
except ImportError:
    print("ezdxf is not installed (package python3-ezdxf)")
    sys.exit(77)


def run(*arguments, status=0, **options):
    done = subprocess.run([BIELLE, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)
    assert done.returncode == status, done.stderr
    return done


class Plates:
    """Centres of circles and pieces of outlines (start, end, degrees of an arc) by layer, mm; texts."""

    def __init__(self, path):
        self.circles, self.outlines, self.texts = {}, {}, []
        drawing = ezdxf.readfile(path)
        assert not drawing.audit().errors
        self.version, self.colors = drawing.dxfversion, {layer.dxf.name: layer.color for layer in drawing.layers}
        for entity in drawing.modelspace():
            layer = entity.dxf.layer
            assert layer in self.colors
            if entity.dxftype() == "CIRCLE":
                self.circles.setdefault(layer, []).append(entity.dxf.center)
                self.diameter = 2 * entity.dxf.radius
            elif entity.dxftype() == "LINE":
                self.outlines.setdefault(layer, []).append((entity.dxf.start, entity.dxf.end, 0))
            elif entity.dxftype() == "ARC":
                turn = (entity.dxf.end_angle - entity.dxf.start_angle) % 360
                self.outlines.setdefault(layer, []).append((entity.start_point, entity.end_point, turn))
            else:
                assert (entity.dxftype(), layer) == ("TEXT", "NOTES")
                self.texts.append(entity.dxf.text)

    def has_distance(self, layer, length):
        return any(abs(a.distance(b) - length) < 1e-6 for a, b in itertools.combinations(self.circles[layer], 2))


class DxfTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.place = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.place.cleanup)
        cls.legs, cls.path = os.path.join(cls.place.name, "legs"), os.path.join(cls.place.name, "plates.dxf")
        values = ("knee=four_bar", "ankle=rsu", "knee_crank=0.043", "knee_arm=0.052")
        run("generate", "leg_biped", *itertools.chain(*(("--set", value) for value in values)), "-o", cls.legs)
        run("convert", cls.legs, "--to", "dxf", "--hole", "6", "-o", cls.path)
        cls.plates = Plates(cls.path)

    def read_offset(self, joint):
        """From the joint that carries its link, in the plane across y, mm: of what the robot's file says."""
        tree = xml.etree.ElementTree.parse(os.path.join(self.legs, "legs.urdf"))
        x, _, z = map(float, tree.find(f"joint[@name='{joint}']/origin").get("xyz").split())
        return 1000 * math.hypot(x, z)

    def test_holes_have_the_distances_of_the_robot(self):
        shank = self.read_offset("ankley_left")
        self.assertGreater(shank, 100)
        self.assertTrue(self.plates.has_distance("SHANK_LEFT", shank))
        self.assertTrue(self.plates.has_distance("SHANK_LEFT", 52))
        self.assertTrue(self.plates.has_distance("CRANK_KNEE_LEFT", 43))
        self.assertFalse(self.plates.has_distance("CRANK_KNEE_LEFT", 43.00001))  # would the check see one?
        self.assertGreaterEqual(self.plates.texts.count("43.000"), 2)
        self.assertTrue({"shank_left", "knee_left", "crank_knee_left"} <= set(self.plates.texts))

    def test_it_is_what_a_workshop_reads(self):
        self.assertEqual(self.plates.version, "AC1009")
        self.assertEqual(self.plates.colors["NOTES"], 8)
        self.assertAlmostEqual(self.plates.diameter, 6)
        with open(self.path) as file:
            self.assertEqual(file.read(16), "999\nmillimetres\n")

    def test_outlines_are_closed_and_stay_away_from_the_holes(self):
        self.assertEqual(set(self.plates.outlines), set(self.plates.circles))
        for layer, outline in self.plates.outlines.items():
            holes = self.plates.circles[layer]
            for (start, end, _), (after, _, _) in zip(outline, outline[1:] + outline[:1]):
                self.assertAlmostEqual(min(start.distance(hole) for hole in holes), 7.5, delta=1e-5, msg=layer)
                self.assertLess(end.distance(after), 1e-9, msg=layer)
            # Arcs turn once about the whole, at its corners.
            self.assertAlmostEqual(sum(turn for _, _, turn in outline), 360, msg=layer)

    def test_nothing_of_one_plate_lies_on_another(self):
        heights = [[start.y for start, _, _ in outline] for outline in self.plates.outlines.values()]
        rows = sorted((min(ys), max(ys)) for ys in heights)
        self.assertGreater(len(rows), 6)
        for (_, high), (low, _) in zip(rows, rows[1:]):
            self.assertGreater(low, high)

    def test_the_same_robot_gives_the_same_bytes(self):
        again = os.path.join(self.place.name, "again.dxf")
        run("convert", self.legs, "--to", "dxf", "--hole", "6", "-o", again)
        with open(self.path, "rb") as one, open(again, "rb") as other:
            self.assertEqual(one.read(), other.read())

    def test_links_that_are_not_plane_are_named(self):
        done = run("convert", "bipetto", "--to", "dxf", "-o", os.path.join(self.place.name, "bipetto.dxf"))
        self.assertRegex(done.stderr, "(?m)^bielle: warning: link 'hip_yaw_left' is left out: ")

    def refuse(self, robot, said, **options):
        path = os.path.join(self.place.name, "refused.dxf")
        self.assertRegex(run("convert", robot, "--to", "dxf", "-o", path, status=2, **options).stderr, said)
        self.assertFalse([name for name in os.listdir(self.place.name) if name.startswith("refused")])

    def test_a_robot_without_plane_links_is_refused(self):
        robot = os.path.join(self.place.name, "arm.urdf")
        with open(robot, "w") as file:
            file.write('<robot name="arm"><link name="base"/><link name="arm"/><joint name="hinge" type="continuous">'
                       '<parent link="base"/><child link="arm"/><axis xyz="0 1 0"/></joint></robot>')
        self.refuse(robot, "^bielle: error: arm: links: none of them is plane: .* --to sheet`\n$")

    def test_a_place_that_cannot_be_written_is_named(self):
        said = run("convert", "fourbar", "--to", "dxf", "-o", "/nowhere/plates.dxf", status=2).stderr
        self.assertRegex(said, "^bielle: error: /nowhere/plates.dxf: file: it cannot be written: ")

    def test_without_ezdxf_its_package_is_named(self):
        os.mkdir(os.path.join(self.place.name, "none"))
        with open(os.path.join(self.place.name, "none", "ezdxf.py"), "w") as file:
            file.write("raise ImportError\n")
        environment = {**os.environ, "PYTHONPATH": os.path.join(self.place.name, "none")}
        self.refuse(self.legs, "^bielle: error: .*Debian: python3-ezdxf\\)\n$", env=environment)


if __name__ == "__main__":
    unittest.main()
