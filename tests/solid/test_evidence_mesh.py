"""Another code's angles on the same mesh (../shared/meshes)."""

import pytest


def test_angles_of_the_fast_module(verification):
    # catches whatever shifts the curve: materials swapped, a lost follower term, another measure of angle
    mesh = verification.evidence_mesh()
    if not mesh.exists():
        pytest.skip(f"{mesh} is not here; FEM_SPA_SHARED names the folder that holds meshes/")
    rows = verification.fast_module()
    assert len(rows) == len(verification.EVIDENCE)
    for pressure, other, same, own in rows:
        assert same == pytest.approx(other, rel=1e-3), pressure
        assert own == pytest.approx(other, rel=1.3e-2), pressure
