"""Linear least squares of efforts of several joints: weights, what is not shown, and covariance.

Every joint counts by what is left of its efforts. What is left is seldom independent from instant to instant: each
joint's is taken as a first-order autoregression, which is taken off rows and efforts alike (Prais and Winsten 1954),
and what correlation is left then goes into the covariance as it is found (Newey and West 1987, with the number of lags
of Andrews 1991). Directions of the parameters that the motion does not show stay out.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from trajevo.base.arrays import Array

#: How often weights and correlations follow from what is left.
_ROUNDS = 6

#: Singular value, as a share of the greatest one, from which on a direction is shown by the motion.
_SHOWN = 1e-6

#: Share of what a direction gives that may be the noise of the positions.
_NOISE = 0.1

#: Share of a parameter in directions that are not shown, from which on it is not known.
_SHARE = 1e-3

#: Greatest correlation from instant to instant that is taken off.
_CORRELATED = 0.99


class Fit(NamedTuple):
    """What least squares found of K parameters.

    Attributes:
        values: shape (K,), NaN for those that the motion does not show.
        covariance: shape (K, K), NaN for those.
        left: standard deviation of what is left of the efforts, by joint, shape (n_joints,).
        scaled: the regressor, its rows weighted and its columns scaled, shape (rows, K).
        freedom: rows less parameters.
    """

    values: Array
    covariance: Array
    left: Array
    scaled: Array
    freedom: int


def fitted(regressor: Array, efforts: Array, scales: Array, noise: Array | None = None) -> Fit:
    """Fit parameters to efforts.

    Args:
        regressor: shape (T, n_joints, K), at instants with about the same time between them.
        efforts: shape (T, n_joints).
        scales: size that each parameter is likely to have, shape (K,).
        noise: how far the regressor may be from the true one, for one draw of the noise, shape of ``regressor``.
    """
    columns = regressor * scales
    wrong = None if noise is None else noise * scales
    least = 1e-12 * np.abs(efforts).max() + np.finfo(float).tiny
    spread, correlation = np.maximum(np.abs(efforts).max(axis=0), least), np.zeros(efforts.shape[1])
    for _ in range(_ROUNDS):
        weighted = _independent(columns, correlation) / spread[:, None]
        noisy = None if wrong is None else _independent(wrong, correlation) / spread[:, None]
        flat = weighted.reshape(-1, len(scales))
        shown, inverse = _directions(flat, None if noisy is None else noisy.reshape(flat.shape))
        values = inverse @ (_independent(efforts, correlation) / spread).reshape(-1)
        residual = efforts - columns @ values
        apart, used = _independent(residual, correlation), spread
        freedom = max(efforts.size - int(shown.sum()), 1)
        spread = np.maximum(np.sqrt((apart**2).sum(axis=0) * efforts.shape[1] / freedom), least)
        correlation = _correlation(residual, least)
    covariance = _covariance(inverse, weighted, apart / used) * (efforts.size / freedom)
    rows = weighted.reshape(-1, len(scales))
    hidden = 1.0 - ((inverse @ rows) ** 2).sum(axis=1) > _SHARE
    values, covariance = values * scales, covariance * scales * scales[:, None]
    values[hidden], covariance[hidden], covariance[:, hidden] = np.nan, np.nan, np.nan
    return Fit(values, covariance, np.sqrt((residual**2).mean(axis=0)), rows, freedom)


def _independent(values: Array, correlation: Array) -> Array:
    """Values (T, n_joints, ...) less what follows from the instant before."""
    share = correlation.reshape(-1, *[1] * (values.ndim - 2))
    found = np.empty_like(values)
    found[0] = values[0] * np.sqrt(1.0 - share**2)
    found[1:] = values[1:] - share * values[:-1]
    return found


def _correlation(residual: Array, least: float) -> Array:
    """Correlation of what is left of each joint from instant to instant, 0 where it may be chance.

    With what was fitted some correlation goes too: it is put back to first order (Marriott and Pope 1954).
    """
    power = (residual**2).sum(axis=0)
    share = (residual[1:] * residual[:-1]).sum(axis=0) / np.maximum(power, least**2)
    chance = 2.0 / np.sqrt(len(residual))
    without_bias = np.clip(share + (1.0 + 4.0 * share) / len(residual), -_CORRELATED, _CORRELATED)
    return np.where(np.abs(share) > chance, without_bias, 0.0)


def _directions(rows: Array, noisy: Array | None) -> tuple[Array, Array]:
    """Which directions the rows show, shape (K,), and their inverse (K, rows) in those directions."""
    left, singular, right = np.linalg.svd(rows, full_matrices=False)
    shown = singular > _SHOWN * singular[0]
    if noisy is not None:
        shown &= np.linalg.norm(noisy @ right.T, axis=0) < _NOISE * singular
    inverse: Array = right[shown].T / singular[shown] @ left[:, shown].T
    return shown, inverse


def _covariance(inverse: Array, columns: Array, residual: Array) -> Array:
    """Covariance of the parameters from what is left, of weighted columns (T, n_joints, K) and residuals."""
    middle = np.zeros((columns.shape[2], columns.shape[2]))
    for k, one in enumerate(residual.T):
        scores = columns[:, k] * one[:, None]
        middle += scores.T @ scores
        lags = _lags(one)
        for lag in range(1, lags + 1):
            across = scores[lag:].T @ scores[:-lag]
            middle += (1.0 - lag / (lags + 1.0)) * (across + across.T)
    bread = inverse @ inverse.T
    covariance: Array = bread @ middle @ bread
    return covariance


def _lags(residual: Array) -> int:
    """Number of instants over which what is left is taken as correlated."""
    power = float((residual**2).sum())
    share = float((residual[1:] * residual[:-1]).sum()) / power if power > 0.0 else 0.0
    share = min(max(share, -0.97), 0.97)
    alpha = 4.0 * share**2 / ((1.0 - share) ** 2 * (1.0 + share) ** 2)
    return min(int(np.ceil(1.1447 * (alpha * len(residual)) ** (1.0 / 3.0))), len(residual) // 4)
