"""What tests share: a small scene, and the command of the same build."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest

import pathspace as ps

SCENE = """<scene version="3.0.0">
    <integrator type="path"><integer name="max_depth" value="5"/></integrator>
    <sensor type="perspective">
        <float name="fov" value="45"/>
        <transform name="to_world"><lookat origin="0, 0, 4" target="0, 0, 0" up="0, 1, 0"/></transform>
        <sampler type="independent"><integer name="sample_count" value="4"/></sampler>
        <film type="hdrfilm">
            <integer name="width" value="24"/>
            <integer name="height" value="16"/>
            <rfilter type="box"/>
        </film>
    </sensor>
    <bsdf type="diffuse" id="grey"><rgb name="reflectance" value="0.5, 0.4, 0.3"/></bsdf>
    <shape type="sphere">
        <point name="center" x="0" y="-0.2" z="0"/>
        <float name="radius" value="0.8"/>
        <ref id="grey"/>
    </shape>
    <shape type="rectangle">
        <transform name="to_world">
            <rotate x="1" angle="90"/>
            <scale value="0.5"/>
            <translate x="0" y="1.5" z="0"/>
        </transform>
        <emitter type="area"><rgb name="radiance" value="8, 8, 6"/></emitter>
    </shape>
</scene>
"""


@pytest.fixture(scope="session")
def scene_file(tmp_path_factory):
    path = tmp_path_factory.mktemp("scene") / "ball.xml"
    path.write_text(SCENE)
    return path


@pytest.fixture(scope="session")
def scene(scene_file):
    return ps.load_file(scene_file)


@pytest.fixture(scope="session")
def command():
    """Runs the command that is in the package; the answer is its last line, read as JSON."""

    def run(*words):
        done = subprocess.run(
            [sys.executable, "-m", "pathspace", *map(os.fspath, words), "--json"], capture_output=True, text=True
        )
        assert done.returncode in (0, 1), done.stderr
        return json.loads(done.stdout.splitlines()[-1])

    return run
