"""Scenes: files, dictionaries, the library, and what is wrong with them."""

import pickle

import numpy as np
import pytest

import pathspace as ps

DICTIONARY = {
    "type": "scene",
    "integrator": {"type": "path", "max_depth": 5},
    "sensor": {
        "type": "perspective",
        "fov": 45.0,
        "to_world": ps.Transform().look_at([0, 0, 4], [0, 0, 0], [0, 1, 0]),
        "sampler": {"type": "independent", "sample_count": 4},
        "film": {"type": "hdrfilm", "width": 24, "height": 16, "rfilter": {"type": "box"}},
    },
    "grey": {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.5, 0.4, 0.3]}},
    "ball": {
        "type": "sphere",
        "center": [0, -0.2, 0],
        "radius": 0.8,
        "bsdf": {"type": "ref", "id": "grey"},
    },
    "lamp": {
        "type": "rectangle",
        "to_world": ps.Transform().translate([0, 1.5, 0]).scale(0.5).rotate([1, 0, 0], 90),
        "emitter": {"type": "area", "radiance": {"type": "rgb", "value": [8, 8, 6]}},
    },
}


def test_a_dictionary_is_the_file(scene):
    built = ps.load_dict(DICTIONARY)
    # Matrices are the same but for their last digits, and so are the images.
    ours, theirs = (ps.render(s, "pt", spp=16) for s in (built, scene))
    assert np.mean(np.abs(ours - theirs)) < 1e-3 * np.mean(theirs)
    assert ps.agree(*[[ps.render(s, "pt", spp=8, seed=k) for k in range(1, 7)] for s in (built, scene)]).verdict != "differ"
    assert built.spp == 4 and built.integrator == "pt" and built.size == (24, 16)


def test_the_same_matrices_give_the_same_bits(scene_file):
    text = scene_file.read_text()
    begin, end = text.index("<lookat"), text.index('up="0, 1, 0"/>') + len('up="0, 1, 0"/>')
    camera = DICTIONARY["sensor"]["to_world"].matrix
    lamp = DICTIONARY["lamp"]["to_world"].matrix
    matrix = lambda m: '<matrix value="{}"/>'.format(" ".join(repr(float(v)) for v in m.flatten()))
    text = text[:begin] + matrix(camera) + text[end:]
    begin, end = text.index("<rotate"), text.index('z="0"/>\n        </transform>') + len('z="0"/>')
    text = text[:begin] + matrix(lamp) + text[end:]
    path = scene_file.with_name("matrices.xml")
    path.write_text(text)
    ours, theirs = (ps.render(s, "bdpt", spp=3) for s in (ps.load_dict(DICTIONARY), ps.load_file(path)))
    assert np.array_equal(ours, theirs)


def test_info_counts_what_is_there(scene):
    info = scene.info()
    assert info["shapes"] == 2 and info["triangles"] == 2
    assert info["emitters"] == {"area": 1} and info["bsdfs"]["diffuse"] >= 1
    assert info["media"] == {} and ps.library["fog-box"].info()["media"] == {"homogeneous": 1}
    assert info["size"] == (24, 16) and info["memory"] > 0 and info["max_depth"] == 5
    assert len(info["hash"]) == 64


def test_the_library_is_there():
    assert "cornell-box" in ps.library and len(ps.library) == len(list(ps.library))
    scene = ps.library("furnace", res=8)
    assert scene.size == (8, 8)
    with pytest.raises(ps.SceneError, match="no scene 'nowhere'"):
        ps.library["nowhere"]


def test_film_and_depth_can_be_changed(scene):
    other = scene.with_film(size=(8, 4), max_depth=2)
    assert other.size == (8, 4) and other.info()["max_depth"] == 2 and scene.size == (24, 16)
    assert other.with_film(crop=(2, 1, 3, 2)).size == (3, 2)
    assert ps.render(other, spp=1).shape == (4, 8, 3)


def test_errors_name_file_and_line(tmp_path):
    path = tmp_path / "bad.xml"
    path.write_text('<scene version="3.0.0">\n<shape type="sphere">\n<lamp/></shape></scene>')
    with pytest.raises(ps.SceneError, match=r"bad\.xml:3: .*lamp"):
        ps.load_file(path)
    with pytest.raises(ps.SceneError, match="gone.xml"):
        ps.load_file(tmp_path / "gone.xml")


def test_bad_dictionaries_name_the_key():
    for scene, text in [
        ({"type": "sphere"}, "'scene'"),
        ({"type": "scene", "a": {"type": "blob"}}, "a: there is no plug-in of type 'blob'"),
        ({"type": "scene", "a": {"type": "sphere", "b": {"radius": 1}}}, "a.b: a dictionary needs a 'type'"),
        ({"type": "scene", "a": {"type": "sphere", "radius": object()}}, "a.radius"),
    ]:
        with pytest.raises(ValueError, match=text):
            ps.load_dict(scene)
    with pytest.raises(ps.SceneError, match="dictionary.xml:3"):
        ps.load_dict({"type": "scene", "a": {"type": "sphere", "radius": "large"}})


def test_scenes_travel_with_their_files(scene, tmp_path):
    model = tmp_path / "tri.obj"
    model.write_text("v -1 -1 0\nv 1 -1 0\nv 0 1 0\nf 1 2 3\n")
    shapes = {**DICTIONARY, "ball": {"type": "obj", "filename": str(model), "bsdf": {"type": "ref", "id": "grey"}}}
    with_mesh = ps.load_dict(shapes)
    carried = pickle.dumps(with_mesh)
    model.unlink()
    there = pickle.loads(carried)
    assert there.hash == with_mesh.hash
    assert np.array_equal(ps.render(there, "pt", spp=2), ps.render(with_mesh, "pt", spp=2))
    again = pickle.loads(pickle.dumps(scene))
    assert again.hash == scene.hash


def test_transforms_are_those_of_mitsuba():
    t = ps.Transform().translate([1, 2, 3]).rotate([0, 0, 1], 90).scale([2, 1, 1])
    assert np.allclose(t.matrix @ [1, 0, 0, 1], [1, 4, 3, 1])
    camera = ps.Transform().look_at([0, 0, 4], [0, 0, 0], [0, 1, 0])
    # +x of a camera is to the left.
    assert np.allclose(camera.matrix[:3, 0], [-1, 0, 0]) and np.allclose(camera.matrix[:3, 2], [0, 0, -1])
    with pytest.raises(ValueError, match="4x4"):
        ps.Transform([1, 2, 3])
