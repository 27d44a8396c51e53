"""Rotations against the matrix exponential, another library and their own inverses."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from planner.physics import attitude, quaternion

COMPONENTS = st.floats(-1.7, 1.7)
VECTORS = st.tuples(COMPONENTS, COMPONENTS, COMPONENTS).map(np.array)  # |φ| < π
TINY = [np.array([1.0, -2.0, 0.5]) * 10.0**-k for k in (1, 3, 6, 9, 200)] + [np.zeros(3)]


def exponential(vector: np.ndarray) -> np.ndarray:
    """exp([φ×]) by another library."""
    return Rotation.from_rotvec(vector).as_matrix()


@settings(deadline=None, max_examples=100)
@given(VECTORS)
def test_rotation_vector_to_matrix_is_the_matrix_exponential(vector: np.ndarray) -> None:
    matrix = quaternion.to_matrix(quaternion.from_rotation_vector(vector))
    np.testing.assert_allclose(matrix, expm(attitude.skew(vector)), atol=1e-13)


@settings(deadline=None, max_examples=100)
@given(VECTORS)
def test_rotation_vector_round_trip(vector: np.ndarray) -> None:
    back = attitude.rotation_vector_from_dcm(exponential(vector))
    np.testing.assert_allclose(back, vector, atol=1e-13)


@pytest.mark.parametrize("vector", TINY)
def test_tiny_rotations_keep_their_digits(vector: np.ndarray) -> None:
    back = attitude.rotation_vector_from_dcm(exponential(vector))
    np.testing.assert_allclose(back, vector, rtol=1e-12, atol=1e-300)


def test_half_turns_come_back_as_the_same_matrix() -> None:
    for axis in np.random.default_rng(1).normal(size=(50, 3)):
        c = exponential(np.pi * axis / np.linalg.norm(axis))
        again = exponential(attitude.rotation_vector_from_dcm(c))
        np.testing.assert_allclose(again, c, atol=1e-14)


@settings(deadline=None, max_examples=100)
@given(st.floats(-np.pi, np.pi), st.floats(-1.57, 1.57), st.floats(-np.pi, np.pi))
def test_roll_pitch_heading_round_trip(roll: float, pitch: float, heading: float) -> None:
    c = Rotation.from_euler("xyz", [roll, pitch, heading]).as_matrix()
    back = Rotation.from_euler("xyz", np.array(attitude.rph_from_dcm(c))).as_matrix()
    np.testing.assert_allclose(back, c, atol=1e-14)


@settings(deadline=None, max_examples=50)
@given(VECTORS, VECTORS)
def test_quaternions_do_what_matrices_do(a: np.ndarray, b: np.ndarray) -> None:
    p, q = quaternion.from_rotation_vector(a), quaternion.from_rotation_vector(b)
    matrices = exponential(a), exponential(b)
    np.testing.assert_allclose(
        quaternion.to_matrix(quaternion.product(p, q)), matrices[0] @ matrices[1], atol=1e-13
    )
    np.testing.assert_allclose(quaternion.rotated(p, b), matrices[0] @ b, atol=1e-13)
    np.testing.assert_allclose(
        quaternion.to_matrix(quaternion.from_matrix(matrices[0])), matrices[0], atol=1e-13
    )


@settings(deadline=None, max_examples=50)
@given(VECTORS, VECTORS)
def test_cross_skew_and_rotate_agree(a: np.ndarray, b: np.ndarray) -> None:
    np.testing.assert_allclose(attitude.cross(a, b), np.cross(a, b), atol=1e-14)
    np.testing.assert_allclose(attitude.rotate(attitude.skew(a), b), np.cross(a, b), atol=1e-14)
