"""Sample adults from ``anny``: the only module that knows that package."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

INNER_PARTS = ("mouth_cavity", "eye_cavity.L", "eye_cavity.R")
AGES = (18.0, 75.0)
STATURES = (1.45, 2.05)
BODY_MASS_INDEX = (16.0, 38.0)
CHUNK = 50


@dataclass(frozen=True)
class Sample:
    """Adults in the A-pose, metres, y up, facing +z, the subject's left at +x.

    Attributes
    ----------
    vertices : (N, V, 3) m
    bones : (N, B, 3) m, heads of the rig's bones
    labels : the B bones' names
    parents : (B,) index of each bone's parent, -1 for the root
    faces : (F, 3)
    inner_faces : (F,) True inside the mouth and behind the eyelids
    weights_index : (V, K) bones that move each vertex
    weights_value : (V, K) their skinning weights
    """

    vertices: np.ndarray
    bones: np.ndarray
    labels: tuple[str, ...]
    parents: np.ndarray
    faces: np.ndarray
    inner_faces: np.ndarray
    weights_index: np.ndarray
    weights_value: np.ndarray


def sample_adults(count: int, seed: int) -> Sample:
    """Draw ``count`` adults whose stature and body mass index lie within the bounds above."""
    import anny
    import torch
    from anny.face_segmentation import get_face_segmentation_mask
    from anny.shape_distribution import SimpleShapeDistribution

    torch.manual_seed(seed)
    model = anny.Anny()
    bounds = [torch.tensor(age, dtype=model.dtype) for age in AGES]
    population = SimpleShapeDistribution(model, torch.distributions.Uniform(*bounds))
    measure = anny.Anthropometry(model)
    vertices: list[np.ndarray] = []
    bones: list[np.ndarray] = []
    drawn = 0
    while sum(len(chunk) for chunk in vertices) < count:
        _, phenotypes = population.sample(CHUNK)
        drawn += CHUNK
        # Most of a real population is clearly of one sex; anny's own sampling is uniform in between.
        phenotypes["gender"] = torch.distributions.Beta(0.3, 0.3).sample((CHUNK,)).to(model.dtype)
        rest = model.get_rest_model(_coefficients(model, phenotypes))
        stature, index = (measure(rest["rest_vertices"])[key] for key in ("height", "bmi"))
        keep = (stature > STATURES[0]) & (stature < STATURES[1])
        keep &= (index > BODY_MASS_INDEX[0]) & (index < BODY_MASS_INDEX[1])
        vertices.append(_y_up(rest["rest_vertices"][keep].numpy()).astype(np.float32))
        bones.append(_y_up(rest["rest_bone_heads"][keep].numpy()))
    return Sample(
        vertices=np.concatenate(vertices)[:count],
        bones=np.concatenate(bones)[:count],
        labels=tuple(model.bone_labels),
        parents=np.array(model.bone_parents),
        faces=model.faces.numpy(),
        inner_faces=get_face_segmentation_mask(model, INNER_PARTS).numpy(),
        weights_index=model.vertex_bone_indices.numpy(),
        weights_value=model.vertex_bone_weights.numpy(),
    )


def _coefficients(model, phenotypes):  # type: ignore[no-untyped-def]
    """Blend-shape coefficients of a dictionary of phenotype values, without facial actions or local changes."""
    import torch

    values = torch.stack([phenotypes[label] for label in model.phenotype_labels], dim=1)
    nothing = torch.zeros(1, 0, dtype=model.dtype)
    return model._get_phenotype_blendshape_coefficients(values, nothing, nothing)


def _y_up(points: np.ndarray) -> np.ndarray:
    """From anny's axes (x left, z up, facing -y) to SMPL's (x left, y up, facing +z)."""
    return np.stack([points[..., 0], points[..., 2], -points[..., 1]], axis=-1)


def load_or_sample(count: int, seed: int, cache: Path | None) -> Sample:
    """``sample_adults``, kept in ``cache`` (an npz) when one is named."""
    if cache is not None and cache.exists():
        with np.load(cache, allow_pickle=False) as file:
            arrays = dict(file)
        return Sample(**{**arrays, "labels": tuple(arrays["labels"].tolist())})
    sample = sample_adults(count, seed)
    if cache is not None:
        np.savez(cache, **{**vars(sample), "labels": np.array(sample.labels)})
    return sample
