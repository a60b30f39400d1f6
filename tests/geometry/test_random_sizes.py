"""Any valid sizes give a sound mesh: random parameters, small shapes."""

import math

import hypothesis.strategies as st
from hypothesis import HealthCheck, Phase, assume, given, settings

import geometry
from geometry import GeometryError

FEW = settings(
    max_examples=5,
    phases=(Phase.explicit, Phase.generate),  # shrinking would mesh for minutes
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much],
)


def mm(low, high):
    return st.floats(low, high).map(lambda x: round(x, 3) * 1e-3)


def sound(shape, size):
    """Mesh a shape, or check that its refusal came from `validate`; the mesh has passed all checks then."""
    try:
        shape.validate()
    except GeometryError:
        assume(False)
    mesh = shape.mesh(size)
    assert set(mesh.surfaces) == set(shape.surface_names())
    assert set(mesh.volumes) == set(shape.volume_names())


@FEW
@given(data=st.data())
def test_pneunet(data):
    draw = data.draw
    inner, wall, top = draw(mm(6, 20)), draw(mm(0.8, 3)), draw(mm(0.8, 3))
    fast_inner, fast_wall = draw(mm(6, 20)), draw(mm(0.8, 3))
    pitch = draw(mm(5, 12))
    shape = geometry.SHAPES["pneunet"](
        slow_chambers=draw(st.integers(0, 2)),
        fast_chambers=draw(st.integers(0, 2)),
        slow_inner_width=inner,
        slow_outer_width=inner + 2 * wall,
        slow_inner_radius=inner / 2 * draw(st.floats(1.0, 1.5)),
        slow_outer_radius=(inner + 2 * wall) / 2 * draw(st.floats(1.0, 1.5)),
        slow_top_wall=top,
        slow_pitch=pitch,
        slow_inner_wall=pitch * draw(st.floats(0.1, 0.5)),
        fast_inner_width=fast_inner,
        fast_outer_width=fast_inner + 2 * fast_wall,
        fast_inner_radius=fast_inner / 2,
        fast_outer_radius=fast_inner / 2 + fast_wall,
        fast_top_wall=fast_wall,
        gap=draw(mm(0.5, 5)),
        lateral_wall=draw(mm(0.5, 2)),
        bridge=draw(mm(2.2, 6)),
        lower_layer=draw(mm(0.5, 3)),
        upper_layer=draw(mm(0.5, 3)),
        half=draw(st.booleans()),
    )
    sound(shape, draw(mm(2.5, 6)))


@FEW
@given(data=st.data())
def test_zigzag(data):
    draw = data.draw
    fold, height = draw(st.floats(0.5, 1.4)), draw(mm(6, 20))
    shape = geometry.SHAPES["zigzag"](
        chambers=draw(st.integers(1, 5)),
        width=draw(mm(6, 20)),
        height=height,
        wall=draw(mm(0.4, 1.2)),
        fold_angle=fold,
        chamber_width=2 * height * math.tan(fold / 2) * draw(st.floats(0.3, 0.9)),
        layer=draw(st.sampled_from([0.0, 0.5e-3, 2e-3])),
        layer_pattern=draw(st.sampled_from(["1", "10", "101", "0110"])),
        half=draw(st.booleans()),
    )
    sound(shape, draw(mm(2, 6)))


@FEW
@given(data=st.data())
def test_bellow(data):
    draw = data.draw
    outer = draw(mm(8, 20))
    count = draw(st.integers(1, 4))
    shape = geometry.SHAPES["bellow"](
        convolutions=count,
        convoluted_height=count * draw(mm(1.5, 4)),
        outer_diameter=outer,
        inner_diameter=outer * draw(st.floats(0.4, 0.7)),
        wall=draw(mm(0.4, 1)),
        collar_height=draw(mm(2, 5)),
        neck_height=draw(mm(2, 5)),
        layer_width=outer * 2,
        soft_layer=draw(st.booleans()),
        share=draw(st.sampled_from([1, 2, 4])),
    )
    sound(shape, draw(mm(1.5, 4)))


@FEW
@given(data=st.data())
def test_tripod(data):
    draw = data.draw
    shape = geometry.SHAPES["tripod"](
        chambers=draw(st.integers(1, 2)),
        chamber_length=draw(mm(5, 12)),
        gap=draw(mm(0.8, 4)),
        outer_radius=draw(mm(18, 26)),
        support_radius=draw(mm(9, 12)),
        duct_inner_radius=draw(mm(3, 5)),
        duct_outer_radius=draw(mm(6, 8)),
        duct_angle=draw(st.floats(0.3, 1.3)),
        slot_angle=draw(st.floats(0.1, 0.4)),
        lateral_wall=draw(mm(0.8, 2)),
        outer_wall=draw(mm(0.8, 3)),
        half=draw(st.booleans()),
    )
    sound(shape, draw(mm(4, 8)))


@FEW
@given(data=st.data())
def test_arm_segment(data):
    draw = data.draw
    outer = draw(mm(5, 9))
    shape = geometry.SHAPES["arm-segment"](
        radius=draw(mm(29, 34)),
        chamber_outer_radius=outer,
        chamber_inner_radius=outer - draw(mm(0.8, 2)),
        chamber_length=draw(mm(20, 40)),
        rings=draw(st.integers(0, 2)),
        ring_thickness=draw(mm(1, 3)),
        ring_bore=draw(mm(4, 10)),
        half=draw(st.booleans()),
    )
    sound(shape, draw(mm(5, 9)))


@FEW
@given(inner=mm(2, 30), ratio=st.floats(1.02, 4), share=st.sampled_from([1, 2, 4, 8]))
def test_ball(inner, ratio, share):
    sound(geometry.SHAPES["ball"](inner_radius=inner, outer_radius=inner * ratio, share=share), inner / 3)


@FEW
@given(inner=mm(2, 10), wall=mm(0.5, 5), long=mm(15, 40), share=st.sampled_from([1, 2, 4]))
def test_tube(inner, wall, long, share):
    shape = geometry.SHAPES["tube"](
        inner_radius=inner, outer_radius=inner + wall, tube_length=long, share=share
    )
    sound(shape, 4e-3)
