"""Any valid sizes give a sound mesh: random parameters, small shapes."""

import hypothesis.strategies as st
from hypothesis import HealthCheck, assume, given, settings

import geometry
from geometry import GeometryError

FEW = settings(
    max_examples=12,
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
    assert geometry.quality(mesh).worst > 0.01


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
