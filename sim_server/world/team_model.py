"""The MuJoCo model of a team: n robots in formation, yokes, payloads, terrain, sensors."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Final

import mujoco
import numpy as np

from quadriga.shared.config.per_robot import friction_of_robots
from quadriga.shared.config.sections import Config
from quadriga.shared.config.terrains import TERRAINS
from quadriga.shared.robots.colours import robot_rgb
from quadriga.shared.robots.conventions import FOOT_FRAMES, GRAVITY, Array, robot_names, yoke_pairs
from quadriga.sim_server.terrain.terrain import NO_CONTACT, Terrain, add_plane, build_course
from quadriga.sim_server.world.layout import JOINT_POSITIONS, NQ
from quadriga.sim_server.world.robot_body import VISUAL_GROUP, RobotBody
from quadriga.sim_server.world.scenario import Load, build_loads

TIMESTEP: Final = 1e-3  # s, one tick

_TERRAIN, _PLACES = 1, 7  # streams of the seed
_YOKE_SOLREF: Final = (0.02, 1.0)  # s, damping ratio
_YOKE_SOLIMP: Final = (0.95, 0.99, 0.001, 0.5, 2.0)
_YOKE_RGBA: Final = (0.85, 0.65, 0.13, 1.0)
_PAYLOAD_BOX: Final = (0.2, 0.15, 0.04)  # m, full lengths; its base lies near the trunk's top
_PAYLOAD_RGBA: Final = (0.55, 0.36, 0.2, 1.0)


@dataclass(frozen=True, slots=True)
class TeamModel:
    """A compiled team, or some robots of it, and what is needed to read its arrays.

    Robot i of this world owns `qpos[19 i : 19 (i + 1)]`, `qvel[18 i : 18 (i + 1)]` and
    `sensordata[22 i : 22 (i + 1)]`, see `layout`; yoke k is tendon k and equality row k.
    """

    model: mujoco.MjModel
    robots: Mapping[str, int]  # names of this world's robots, and their indices in the team
    terrain: Terrain  # the ground, for its height
    trunks: np.ndarray[tuple[int], np.dtype[np.intp]]  # body id of each trunk, shape (n,)
    yokes: tuple[tuple[int, int], ...]  # the pairs of robot indices that are yoked
    rest_length: Array  # length of each yoke at the spawn, shape (k,), m
    payload: tuple[Load, ...]  # load on each robot of the team
    q_spawn: Array  # positions at the spawn, shape (19 n,); the terrain's bodies follow


def formation(n: int, spacing: float) -> Array:
    """Spawn positions of the trunks, two columns heading along x. Shape (n, 2), m, world.

    Robot i stands at x = −spacing · ⌊i/2⌋, left if i is even and right if odd; the last of an odd
    number, and a single robot, stand on the centre line.
    """
    index = np.arange(n)
    side = np.where(index % 2 == 0, 0.5, -0.5)
    if n % 2:
        side[-1] = 0.0
    return np.stack([-spacing * (index // 2), spacing * side], axis=1)


def spawn_positions(config: Config) -> Array:
    """Spawn positions off the formation by up to `world.scatter`. Shape (n, 2), m, world.

    Each robot's draw is the same however many others there are.
    """
    places, reach = formation(config.team.robots, config.team.spacing), config.world.scatter
    random = np.random.default_rng((config.world.seed, _PLACES))
    return places + random.uniform(-reach, reach, places.shape)


def build_terrain(config: Config) -> Terrain:
    """The terrain of a configuration, drawn from `world.seed`; flat under the spawned team.

    The flat place does not depend on where exactly the robots stand.
    """
    world, places = config.world, formation(config.team.robots, config.team.spacing)
    if not world.uneven:
        return Terrain()
    module, _, function = TERRAINS[world.terrain].builder.partition(":")
    build = getattr(import_module(f"quadriga.sim_server.terrain.{module}"), function)
    random = np.random.default_rng((world.seed, _TERRAIN))
    terrain: Terrain = build(build_course(config, places), world, random)
    return terrain


def build_team_model(
    config: Config, dress: Callable[[mujoco.MjSpec], None] | None = None, names: Sequence[str] = ()
) -> TeamModel:
    """Build and compile the world of a configuration; equal configurations give equal models.

    Args:
        config: the team's configuration.
        dress: gets the world before it is compiled, to change what pictures of it show.
        names: the robots that are in this world, at their places in the team; by default all.

    Raises:
        ConfigError: the payload or `world.friction_of` names no robot, the reference's trace is no
            trace, or the robot's URDF is missing.
    """
    team, world, robot = robot_names(config.team.robots), config.world, config.robot
    robots = {name: i for i, name in enumerate(team) if not names or name in names}
    places, payload = spawn_positions(config).tolist(), build_loads(config)
    terrain = build_terrain(config)
    spec = mujoco.MjSpec()
    _set_physics(spec)
    _set_visuals(spec)
    add_plane(spec, loose=terrain.loose)
    terrain.add_to(spec)
    friction = friction_of_robots(world.friction_of, world.friction, team)
    body = RobotBody(robot, config.motors, leg_collisions=world.leg_collisions)
    lying = world.initial_posture == "lying"
    height = robot.lying_height if lying else robot.stand_height
    for name, i in robots.items():
        place = (*places[i], height)
        trunk = body.add_to(spec, f"{name}/", place, friction[i], (*robot_rgb(i), 1.0))
        if name == next(iter(robots)):
            _add_sun(trunk)
        trunk.add_site(name=f"{name}/yoke", pos=robot.yoke, group=4)
        if payload[i].mass > 0.0:
            _add_payload(trunk, f"{name}/payload", payload[i], robot.yoke)
        _add_sensors(spec, f"{name}/")
    here = {i: k for k, i in enumerate(robots.values())}
    pairs = yoke_pairs(len(team), config.team.yokes)
    yokes = tuple((here[i], here[j]) for i, j in pairs if i in here and j in here)
    for i, j in yokes:
        _add_yoke(spec, *(list(robots)[k] for k in (i, j)))
    terrain.add_bodies(spec, len(robots), world.friction)
    if dress is not None:
        dress(spec)
    model = spec.compile()
    q_spawn = model.qpos0.copy()
    of_robots = q_spawn[: len(robots) * NQ].reshape(len(robots), NQ)
    of_robots[:, JOINT_POSITIONS] = robot.q_lying if lying else robot.q_stand
    return TeamModel(
        model=model,
        robots=robots,
        terrain=terrain,
        trunks=np.array([model.body(f"{name}/trunk").id for name in robots]),
        yokes=yokes,
        rest_length=model.tendon_length0.copy(),
        payload=payload,
        q_spawn=q_spawn,
    )


def _set_physics(spec: mujoco.MjSpec) -> None:
    spec.option.timestep = TIMESTEP
    spec.option.gravity = [0.0, 0.0, -GRAVITY]
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.impratio = 10.0
    # An unstable simulation must end the walk, not restart at the spawn.
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    spec.compiler.degree = False


def _set_visuals(spec: mujoco.MjSpec) -> None:
    spec.visual.global_.offwidth, spec.visual.global_.offheight = 1920, 1080
    spec.visual.headlight.ambient = [0.35, 0.35, 0.35]
    spec.visual.headlight.diffuse = [0.4, 0.4, 0.4]
    spec.visual.quality.shadowsize = 4096
    spec.visual.map.shadowclip = 1.0
    spec.stat.extent = 3.0  # m; shadows and clipping must not depend on the size of the terrain
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        width=128,
        height=768,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=[0.55, 0.70, 0.90],
        rgb2=[0.93, 0.95, 0.97],
    )


def _add_sun(trunk: mujoco.MjsBody) -> None:
    """A light that follows a trunk, so that shadows stay sharp wherever the team walks."""
    trunk.add_light(
        mode=mujoco.mjtCamLight.mjCAMLIGHT_TRACK,
        type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
        pos=[0.0, 0.0, 4.0],
        dir=[0.0, 0.0, -1.0],
        diffuse=[0.5, 0.5, 0.5],
        castshadow=1,
    )


def _add_payload(trunk: mujoco.MjsBody, name: str, load: Load, mount: Sequence[float]) -> None:
    """A homogeneous box welded on top of the trunk, at `mount` if the load is not offset."""
    (x, y), size = load.offset, [length / 2 for length in _PAYLOAD_BOX]
    body = trunk.add_body(name=name, pos=(mount[0] + x, mount[1] + y, mount[2]))
    look = {"rgba": _PAYLOAD_RGBA, "group": VISUAL_GROUP}
    box = mujoco.mjtGeom.mjGEOM_BOX
    body.add_geom(type=box, size=size, mass=load.mass, **look, **NO_CONTACT)


def _add_yoke(spec: mujoco.MjSpec, first: str, second: str) -> None:
    """A rod between two ball joints: the distance of their anchors is held at its spawn value."""
    name = f"{first}-{second}"
    rod = spec.add_tendon(name=name, width=0.008, rgba=_YOKE_RGBA)
    rod.wrap_site(f"{first}/yoke")
    rod.wrap_site(f"{second}/yoke")
    spec.add_equality(
        type=mujoco.mjtEq.mjEQ_TENDON,
        objtype=mujoco.mjtObj.mjOBJ_TENDON,
        name1=name,
        solref=_YOKE_SOLREF,
        solimp=_YOKE_SOLIMP,
        data=[0.0] * 12,
    )


def _add_sensors(spec: mujoco.MjSpec, prefix: str) -> None:
    """The robot's block of `sensordata`, in the order of `layout`."""
    site, geom, kind = mujoco.mjtObj.mjOBJ_SITE, mujoco.mjtObj.mjOBJ_GEOM, mujoco.mjtSensor
    for of_imu in (kind.mjSENS_GYRO, kind.mjSENS_ACCELEROMETER):
        spec.add_sensor(type=of_imu, objtype=site, objname=prefix + "imu")
    for foot in FOOT_FRAMES:
        spec.add_sensor(type=kind.mjSENS_TOUCH, objtype=site, objname=prefix + foot)
    for foot in FOOT_FRAMES:
        # intprm: which fields (bit 1: force), how contacts are reduced (3: net force), how many.
        force = {"type": kind.mjSENS_CONTACT, "intprm": [2, 3, 1]}
        spec.add_sensor(objtype=geom, objname=prefix + foot, **force)
