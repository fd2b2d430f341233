"""Where OpenGL runs on the processor a picture comes to rest, whatever size it moves at."""

import time
from collections.abc import Iterator
from dataclasses import replace

import moderngl
import numpy as np
import pytest
import torch

from app.gl.layered import LayeredLevel
from app.gl.processor import still
from app.gl.scene import Thinned
from app.gl.tiled import trial
from app.gl.tiled.splats import TiledSplats
from app.gl.tiled.trial import Trial
from app.window.drawing.card import CardPicture
from app.window.drawing.processor import ProcessorPicture
from app.window.drawing.stills import RETRY_SECONDS
from app.window.governor import Governor, Kind, Plan
from app.window.scene import commands as show
from app.window.scene.commands import SceneArrived
from app.window.scene.memory import SceneMemory
from app.window.scene.work import ThinAround
from app.window.state import State
from app.window.viewport import Viewport
from langflash_core.base import pictures
from langflash_core.base.graphics import COMPUTE
from langflash_core.errors import GraphicsError
from langflash_core.geometry.nearness import NEAREST
from langflash_core.geometry.poses import Vector, from_view, orbit
from langflash_core.language.relevance import compile_query
from langflash_core.language.spaces import language_space
from langflash_core.scene.edited import first_marks
from langflash_core.scene.edits import History, delete
from langflash_core.scene.exposure import lit_camera
from langflash_core.scene.mask import Mask
from langflash_core.scene.thin import coarse_share, thin_with_rows
from langflash_core.types import Scene
from tests.app.gl.test_gl_layers import layered
from tests.app.window.scenes import PHRASES, VIEWS, after, room, shown_scene

SIZE, START = (160, 120), VIEWS[0]


class Quick(Governor):
    """Moves with all pixels, however slow this machine is."""

    def moving(self, wanted: Kind) -> Plan:
        return Plan(wanted)


class Stubborn(Governor):
    """Moves at three quarters of the size, however quick this machine is."""

    def moving(self, wanted: Kind) -> Plan:
        return Plan(wanted, 0.75)


def spoken_room() -> Scene:
    return room(language_space("minilm").encode(list(PHRASES)))


def showing(scene: Scene, serial: int = 1, **changes) -> State:
    """A state with this scene and the phrase "door"."""
    info = shown_scene().scene.info
    assert info is not None
    return shown_scene().with_scene(info=replace(info, serial=serial, scene=scene), **changes)


def living(
    viewport: Viewport, state: State, governor: type[Governor] | None = None, count: int = 300, turns: int = 0
) -> Iterator[State]:
    """Frames of 50 ms each, in the first `turns` of which a hand orbits. governor: of every frame."""
    for turn in range(count):
        if turns:
            state = state.with_scene(pose=orbit(START, 0.02 * min(turn, turns), 0.0))
        if governor is not None and viewport.picture is not None:
            viewport.picture.governor = governor(slow=True)
        state = replace(state, now=state.now + 0.05)
        viewport.update(state, SIZE, touched=state.now if turn < turns else 0.0)
        yield state
        time.sleep(0.01)


def on_the_processor(viewport: Viewport) -> ProcessorPicture:
    """Its picture; the test ends here where OpenGL draws all pictures itself."""
    if not isinstance(viewport.picture, ProcessorPicture):
        pytest.skip("OpenGL here has a graphics card, which draws all pictures itself")
    return viewport.picture


def test_a_picture_comes_to_rest_in_full(viewport) -> None:
    """A half-size picture that does not cover what moves would be drawn over, and ordered again, for ever."""
    space = language_space("minilm")
    scene = spoken_room()
    state = showing(scene, mode=pictures.HEAT)
    viewport.set_scene(1, scene)
    on_the_processor(viewport)
    viewport.ask((0,), compile_query(scene, space, list(PHRASES[:1])))
    plans: list[Plan] = []
    for _ in living(viewport, state, Stubborn):
        plan = getattr(viewport.drawn, "plan", None)
        if plan is not None and (not plans or plans[-1] != plan):
            plans.append(plan)
        if plan == Plan(Kind.MAPS) and not viewport.settling:
            break
    assert plans[-1] == Plan(Kind.MAPS)
    assert len(plans) <= 3, "the moving one, and what follows it at rest"


def test_what_moves_in_full_size_is_followed_by_the_exact_picture(viewport) -> None:
    """In a small room it has all pixels, and still ends footprints early: at rest it is not the last one."""
    scene = spoken_room()
    state = showing(scene).with_asking(prompts=())
    viewport.set_scene(1, scene)
    picture = on_the_processor(viewport)
    plans = []
    for _ in living(viewport, state, Quick):
        plans.append(getattr(viewport.drawn, "plan", None))
        if viewport.whole:
            break
    still = picture.stills.shown
    assert Plan(Kind.COLOUR) in plans[:-1], "the moving one came first"
    assert still is not None and (still.camera.width, still.camera.height) == SIZE


def test_another_way_to_draw_is_taken_at_once(viewport, monkeypatch) -> None:
    """As on a card whose trial said quads."""
    for module in ("window.viewport", "gl.tiled.trial"):
        monkeypatch.setattr(f"app.{module}.draws_in_software", lambda ctx: False)
    monkeypatch.setattr("app.gl.tiled.trial.kept", lambda ctx: Trial(1.0, 2.0))
    scene = spoken_room()
    state = showing(scene).with_asking(prompts=())
    viewport.set_scene(1, scene)
    pictures: list[np.ndarray] = []
    for wanted, way in (("measured", "quads"), ("tiles", "tiles"), ("quads", "quads")):
        viewport.draw_with(wanted)
        if wanted == "tiles" and viewport.stats(card="A card").renderer != "A card, tiles":
            pytest.skip("OpenGL 4.3 is not here")
        for _ in living(viewport, state):
            if viewport.whole:
                break
        assert viewport.stats(card="A card").renderer == f"A card, {way}"
        level = viewport.picture.easel.renderer.picture().level
        assert all((type(part.splats) is TiledSplats) == (way == "tiles") for part in level.parts)
        pictures.append(viewport.seen().astype(int))
    quads, tiles, again = pictures
    assert np.array_equal(quads, again) and quads.max() > 100
    # A few layers of float16 lose 2^-10 each as quads, which is a step of the screen's at the most.
    assert 0 < np.abs(tiles - quads).max() <= 3


@pytest.fixture
def on_trial(context, monkeypatch, tmp_path) -> list[str]:
    """As on a card that was never tried; what its trial of three steps does, which says tiles."""
    if context.version_code < COMPUTE:
        pytest.skip("OpenGL 4.3 is not here")
    steps: list[str] = []

    def measuring(_ctx):
        try:
            for _ in range(3):
                steps.append("step")
                yield
        finally:
            steps.append("end")
        return Trial(2.0, 1.0)

    monkeypatch.setenv("LANGFLASH_CONFIG", str(tmp_path))
    monkeypatch.setattr(trial, "measuring", measuring)
    for module in ("window.viewport", "gl.tiled.trial"):
        monkeypatch.setattr(f"app.{module}.draws_in_software", lambda ctx: False)
    return steps


def test_a_trial_takes_a_step_a_frame_before_there_is_a_scene(viewport, on_trial) -> None:
    assert viewport.warm() and on_trial == ["step"], "no frame waits for the whole trial"
    assert viewport.stats(card="A card").renderer == "A card, quads"
    for _ in range(3):
        viewport.warm()
    assert on_trial == ["step"] * 3 + ["end"]
    assert viewport.stats(card="A card").renderer == "A card, tiles"


def test_a_trial_goes_on_when_the_picture_rests(viewport, on_trial) -> None:
    scene = spoken_room()
    viewport.set_scene(1, scene)
    ways = []
    for _ in living(viewport, showing(scene).with_asking(prompts=()), turns=10, count=100):
        ways.append(viewport.stats(card="A card").renderer)
        if len(ways) == 10:
            assert not on_trial and viewport.texture is not None, "while a hand moves nothing is tried"
        if "end" in on_trial and viewport.whole:
            break
    assert ways[-1] == "A card, tiles" and on_trial == ["step"] * 3 + ["end"]


def test_a_window_that_is_closed_during_a_trial_makes_it_anew(viewport, on_trial) -> None:
    viewport.warm()
    viewport.release()
    assert on_trial == ["step", "end"]
    assert viewport.warm() and on_trial == ["step", "end", "step"]


def test_a_driver_that_refuses_tiles_draws_quads_and_says_so_once(viewport, on_trial, monkeypatch) -> None:
    def refuse(*_):
        raise moderngl.Error("this driver compiles nothing")

    monkeypatch.setattr(TiledSplats, "project", refuse)
    scene = spoken_room()
    state = showing(scene).with_asking(prompts=())
    viewport.draw_with("tiles")
    viewport.set_scene(1, scene)
    with pytest.raises(GraphicsError, match="choose Quads"):
        next(frame for frame in living(viewport, state) if viewport.whole)
    next(frame for frame in living(viewport, state) if viewport.whole)
    assert viewport.stats(card="A card").renderer == "A card, quads" and not on_trial
    assert viewport.seen().max() > 100


def test_pictures_that_move_and_that_rest_are_in_the_light_of_their_place(viewport) -> None:
    plain = room(torch.eye(3, 384))
    rows = [[1.4, 1.2, 0.8]] * plain.num_views
    scene = plain.with_record(light={"gains": rows, "offsets": [[0.1, 0.0, -0.1]] * plain.num_views})
    state = showing(scene)
    drawn = set()
    viewport.set_scene(1, scene)
    for turn, _ in enumerate(living(viewport, state, turns=5)):
        easel = None if viewport.picture is None else viewport.picture.easel
        if easel is not None and easel.camera is not None and viewport.drawn is not None:
            expected = lit_camera(scene, replace(easel.camera, light=None)).light
            assert easel.camera.light is not None and expected is not None
            assert torch.equal(easel.camera.light, expected)
            drawn.add(getattr(viewport.drawn, "plan", None))
        if turn > 5 and viewport.whole and not viewport.settling:
            break
    assert drawn & {Plan(Kind.COLOUR), Plan(Kind.MAPS)}, "the one at rest, whichever the machine has time for"


def test_a_scene_begins_without_the_targets_of_the_one_before(viewport) -> None:
    """What its modes took: 30 MB at 652 x 616 after a look at a heat-map, weight maps more."""
    scene, other = spoken_room(), spoken_room()
    state = showing(scene, mode=pictures.HEAT)
    viewport.set_scene(1, scene)
    viewport.ask((0,), compile_query(scene, language_space("minilm"), list(PHRASES[:1])))
    *_, state = living(viewport, state, count=3)
    view = viewport._made().canvas.view(viewport.stats().picture_size)
    viewport.set_scene(2, other)
    held = viewport._made().canvas.holds(view)
    list(living(viewport, replace(showing(other, 2, mode=pictures.HEAT), now=state.now), count=3))
    drawn = viewport.texture
    assert not held and drawn is not None


def test_a_changed_scene_shows_its_last_picture_until_the_next(viewport) -> None:
    """The empty window's "Drop photos of a room here" came in between, at every part taken out or copied."""
    scene, other = spoken_room(), spoken_room()
    state = showing(scene).with_asking(prompts=())
    viewport.set_scene(1, scene)
    state = next(each for each in living(viewport, state) if viewport.texture is not None)
    assert viewport.texture is not None
    before = viewport.texture.read()
    viewport.set_scene(2, other, changed=True)
    kept = viewport.texture
    assert kept is not None and kept.read() == before
    assert viewport.seen() is None, "what was hidden for good may be in it"
    next(each for each in living(viewport, state) if viewport.seen() is not None)
    assert viewport.texture is not kept and not hasattr(kept.mglo, "use")
    viewport.set_scene(3, scene)
    assert viewport.texture is None, "another scene's would mislead"


def test_a_picture_that_could_not_be_drawn_is_told_and_tried_again(viewport, monkeypatch) -> None:
    broken, tried = [True], []
    real = still.draw_still

    def draw_still(*args, **named):
        tried.append(named["weight_maps"])
        if broken[0]:
            raise MemoryError("a picture too many")
        return real(*args, **named)

    monkeypatch.setattr("app.window.drawing.stills.draw_still", draw_still)
    scene = spoken_room()
    state = showing(scene)
    viewport.set_scene(1, scene)
    on_the_processor(viewport)
    state = next(each for each in living(viewport, state, Stubborn) if viewport.failing)
    assert len(tried) == 1
    wait = viewport.update(state, SIZE, touched=0.0)
    assert 0 < wait <= RETRY_SECONDS and not viewport.settling, "not at once, and not never"
    broken[0] = False
    state = replace(state, now=state.now + RETRY_SECONDS)
    wanted = lambda: getattr(viewport.drawn, "plan", Plan(Kind.FAST, 0.5)).scale == 1.0  # noqa: E731
    assert any(wanted() for _ in living(viewport, state, Stubborn)) and not viewport.failing


def test_only_the_picture_on_show_is_scored(viewport) -> None:
    """A score and the picture beside it are of the same place, the same marks and the same question."""
    space = language_space("minilm")
    scene = spoken_room()
    state = showing(scene, mode=pictures.HEAT)
    query = compile_query(scene, space, list(PHRASES[:1]))
    viewport.set_scene(1, scene)
    viewport.ask((0,), query, state.asking.revision)
    view, frames = None, living(viewport, state, count=600)
    for state in frames:
        view = viewport.view(state)
        if view is not None:
            break
    assert view is not None and viewport.view(state) is None, "once"
    viewport.ask((0,), query, state.asking.revision)
    assert viewport.view(state.with_scene(pose=orbit(state.scene.pose, 0.2, 0.0))) is None, "of another place"
    lapsed = state.with_asking(revision=state.asking.revision + 1)
    assert viewport.view(lapsed) is None, "of a question that holds no more"
    assert viewport.view(state) is not None


def test_gaps_are_filled_as_the_preference_says(viewport) -> None:
    """The picture follows it at once, without another drawing."""
    plain = spoken_room()
    scene = replace(plain, view_ids=torch.zeros(len(plain.gaussians), dtype=torch.int64))
    aside = orbit(START, 1.0, 0.0)  # beside the wall nothing is drawn
    state = showing(scene, pose=aside)
    viewport.set_scene(1, scene)
    drawn, pictures = object(), []
    while viewport.drawn is not drawn:  # the governor finds its size
        drawn = viewport.drawn
        for _ in range(4):
            viewport.update(state, SIZE, touched=0.0)
    for fill in (True, False, True):
        state = replace(state, preferences=replace(state.preferences, fill_gaps=fill, near_photos=False))
        viewport.update(state, SIZE, touched=0.0)
        assert viewport.texture is not None and viewport.drawn is drawn
        pictures.append(np.frombuffer(viewport.texture.read(), np.uint8))
    assert np.array_equal(pictures[0], pictures[2]) and (pictures[0] != pictures[1]).any()


def test_a_scene_with_levels_moves_coarse_and_rests_whole(viewport, monkeypatch) -> None:
    """Where OpenGL runs on the processor, until some detail is chosen."""
    monkeypatch.setattr("app.window.governor.MIDDLING_SCENE", 10_000)
    scene = spoken_room()
    levels = (torch.arange(len(scene.gaussians)) % 4 > 0).to(torch.uint8)
    scene = replace(scene, levels=levels)
    state = showing(scene).with_asking(prompts=())
    viewport.set_scene(1, scene)
    picture = viewport.picture
    assert picture is not None
    if not isinstance(picture, ProcessorPicture):
        assert picture.governor.share == 1
        pytest.skip("OpenGL here has a graphics card, which draws all pictures itself")
    plans = []
    for turn in range(40):
        pose = orbit(START, 0.02 * min(turn, 20), 0.0)
        state = replace(state.with_scene(pose=pose), now=state.now + 0.05)
        viewport.update(state, SIZE, touched=state.now)
        plans.append(getattr(viewport.drawn, "plan", None))
        if turn == 20:
            marks = first_marks(scene)
            viewport.mark(SceneMemory(scene), delete(marks, Mask.first(marks.selected.count, 90)), None)
    moved = {plan.share for plan in plans if plan is not None}
    live = viewport._made()._scene
    assert live is not None and {*live._levels} == {0.25}
    for share in viewport.shares:
        viewport.thin(scene, share, Thinned(*thin_with_rows(scene, share)))
    assert picture.governor.ladder[2:4] == ((0.75, 0.625), (0.5, 0.625))
    for _ in living(viewport, state):
        if getattr(viewport.drawn, "plan", None) == Plan(Kind.COLOUR):
            break
    rested = getattr(viewport.drawn, "plan", None)
    assert 0.25 in moved and moved <= {0.25, 1.0}
    assert rested == Plan(Kind.COLOUR), "all of them"


def test_a_scene_of_layers_is_made_ready_a_layer_a_frame(viewport, monkeypatch) -> None:
    """Buffers of one layer, or one shader, in each frame, also where the camera leaps to another photo; then
    the picture that rests."""
    scene, made = layered(12, count=60), []
    real = LayeredLevel._made

    def counted(level: LayeredLevel, view: int):
        if len(level._scene.gaussians) > NEAREST:  # not what shaders are compiled with
            made.append(view)
        return real(level, view)

    monkeypatch.setattr(LayeredLevel, "_made", counted)
    info = showing(scene).scene.info
    assert info is not None
    state = after(State(), SceneArrived(replace(info, history=History(first_marks(scene)))))
    viewport.set_scene(1, scene)
    programs = viewport._made().canvas.painter.programs._made
    compiled = set()
    for view in (2, 9):
        own = scene.camera(view)
        seen = own.viewmat.double().numpy(), own.K.double().numpy(), (own.width, own.height)
        state = state.with_scene(pose=from_view(*seen, 1.0))
        before = len(made)
        for _ in range(300):
            counts = len(made), len(programs)
            state = replace(state, now=state.now + 0.05)
            viewport.update(state, SIZE, touched=0.0)
            assert len(made) <= counts[0] + 1
            if len(programs) > counts[1] and viewport.drawn is None:
                compiled |= set(programs)
                assert len(programs) == counts[1] + 1
            if viewport.whole and not viewport.settling:
                break
            time.sleep(0.01)
        assert viewport.whole and len(made) > before
    assert "blend.frag" in str(compiled)


def test_of_a_huge_scene_only_a_share_is_brought_to_opengl_on_the_processor(viewport, monkeypatch) -> None:
    """All of ten million stopped the window for half a minute; at rest threads draw them all."""
    monkeypatch.setattr("app.window.governor.HUGE_SCENE", 10_000)
    monkeypatch.setattr("app.window.governor.LARGE_SCENE", 2_000)
    space = language_space("minilm")
    scene = spoken_room()
    share = 2_000 / len(scene.gaussians)
    state = showing(scene)
    viewport.set_scene(1, scene)
    if isinstance(viewport.picture, CardPicture):
        pytest.skip("OpenGL here has a graphics card")
    assert viewport.picture is None and viewport.shares == () and not viewport.whole
    eye = state.scene.pose.centre
    assert viewport.share_around(eye) == share and viewport.share_around(eye) is None, "it is on its way"
    viewport.ask((0,), compile_query(scene, space, list(PHRASES[:1])))
    viewport.update(state, SIZE, touched=0.0)
    other = room(torch.eye(3, 384))
    viewport.thin(other, share, Thinned(*thin_with_rows(other, share)))  # of a scene that was there before
    assert viewport.picture is None and viewport.drawn is None
    made, fewer = ThinAround(1, SceneMemory(scene), share, eye).run(lambda: False)
    assert isinstance(made, show.Thinned) and isinstance(fewer, show.Thinned)
    viewport.thin(made.scene, made.share, made.thinned, made.around)
    picture = viewport.picture
    assert picture is not None and picture.easel.asked.keys == (0,) and viewport.shares == ()
    plans = []
    for turn, now in enumerate(living(viewport, state, turns=20)):
        state = now
        plans.append(getattr(viewport.drawn, "plan", None))
        if turn > 20 and viewport.whole and not viewport.settling:
            break
    live = viewport._made()._scene
    assert live is not None and {*live._levels} == {share}
    viewport.thin(fewer.scene, fewer.share, fewer.thinned, fewer.around)
    assert viewport.picture is not None and viewport.picture.governor.ladder[-1] == (0.25, share / 4)
    assert {*live._levels} == {share, share / 4} and {*fewer.thinned.rows} <= {*made.thinned.rows}
    moved = {plan.share for plan in plans[:20] if plan is not None}
    assert moved == {share} and plans[-1] is not None and plans[-1].share == 1
    # From far away other ones are chosen; the picture at rest stays, and the next that moves has them.
    assert made.around is not None and viewport.share_around(eye) is None
    far = Vector(eye.x, eye.y, eye.z - made.around.reach)
    assert viewport.share_around(far) == share
    other, _ = ThinAround(1, SceneMemory(scene), share, far).run(lambda: False)
    assert isinstance(other, show.Thinned)
    shown, level = viewport.drawn, live.level(share)
    viewport.thin(other.scene, other.share, other.thinned, other.around)
    viewport.update(replace(state, now=state.now + 0.05), SIZE, touched=0.0)
    assert viewport.drawn == shown and viewport.texture is not None
    for turn in range(60):
        state = replace(state.with_scene(pose=orbit(START, -0.02 * turn, 0.0)), now=state.now + 0.05)
        viewport.update(state, SIZE, touched=state.now)
    assert live.level(share) is not level and viewport.texture is not None and viewport.whole is False
    assert np.array_equal(live.level(share)._rows, other.thinned.rows)


def test_the_coarse_ones_of_a_large_scene_are_taken_beside_the_frames(viewport, monkeypatch) -> None:
    """Of 2.6 million they stopped the window for a quarter of a second, when it was opened."""
    monkeypatch.setattr("app.window.governor.MANY_ROWS", 10_000)
    monkeypatch.setattr("app.window.governor.MIDDLING_SCENE", 10_000)
    scene = spoken_room()
    scene = replace(scene, levels=(torch.arange(len(scene.gaussians)) % 4).clamp(max=1).to(torch.uint8))
    share = coarse_share(scene)
    viewport.set_scene(1, scene)
    if isinstance(viewport.picture, CardPicture):
        pytest.skip("OpenGL here has a graphics card")
    assert viewport.picture is None and viewport.shares == (share,)
    viewport.thin(scene, share, Thinned(*thin_with_rows(scene, share)))
    picture = viewport.picture
    assert isinstance(picture, ProcessorPicture) and picture.governor.share == share
    live = viewport._made()._scene
    assert live is not None and {*live._levels} == {share}
