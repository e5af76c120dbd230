"""Linear least squares of efforts of several joints: weights, what is not shown, and covariance.

Every joint counts by what is left of its efforts. What is left is seldom independent from instant to instant: each
joint's is taken as a first-order autoregression, which is taken off rows and efforts alike (Prais and Winsten 1954).
What is left is less than the noise, and less correlated, as the parameters follow the noise: variances and correlations
are those by which what is left is as expected, E[r rᵀ] = Σ - X C Xᵀ. What correlation remains goes into the covariance
as it is found (Newey and West 1987, with the number of lags of Andrews 1991), and every row counts by what it would
miss were it left out (MacKinnon and White 1985). Directions of the parameters that the motion does not show stay out.
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

#: Least share of a row that is taken as not followed by the parameters.
_FREE = 0.1


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
        residual, bread = efforts - columns @ values, inverse @ inverse.T
        apart = _independent(residual, correlation)
        share = _followed(weighted, bread, weighted)
        of_rows = apart / spread / np.maximum(1.0 - share, _FREE)
        spread = np.maximum(np.sqrt((apart**2).sum(axis=0) / np.maximum(len(apart) - share.sum(axis=0), 1.0)), least)
        correlation = _correlation(residual, columns, bread, least)
    covariance = bread @ _middle(weighted, of_rows) @ bread
    hidden = 1.0 - ((inverse @ flat) ** 2).sum(axis=1) > _SHARE
    values, covariance = values * scales, covariance * scales * scales[:, None]
    values[hidden], covariance[hidden], covariance[:, hidden] = np.nan, np.nan, np.nan
    freedom = max(efforts.size - int(shown.sum()), 1)
    return Fit(values, covariance, np.sqrt((residual**2).mean(axis=0)), flat, freedom)


def _followed(rows: Array, bread: Array, others: Array) -> Array:
    """Covariance of what the parameters add to two sets of rows (T, n_joints, K), shape (T, n_joints)."""
    found: Array = ((rows @ bread) * others).sum(axis=2)
    return found


def _independent(values: Array, correlation: Array) -> Array:
    """Values (T, n_joints, ...) less what follows from the instant before."""
    share = correlation.reshape(-1, *[1] * (values.ndim - 2))
    found = np.empty_like(values)
    found[0] = values[0] * np.sqrt(1.0 - share**2)
    found[1:] = values[1:] - share * values[:-1]
    return found


def _correlation(residual: Array, columns: Array, bread: Array, least: float) -> Array:
    """Correlation of the noise of each joint from instant to instant, 0 where it may be chance.

    Args:
        residual: what is left of the efforts, shape (T, n_joints).
        columns: the regressor, shape (T, n_joints, K).
        bread: covariance of the parameters, shape (K, K).
        least: what counts as nothing.
    """
    count = len(residual)
    power = (residual**2 + _followed(columns, bread, columns)).sum(axis=0) / count
    across = residual[1:] * residual[:-1] + _followed(columns[1:], bread, columns[:-1])
    share = across.sum(axis=0) / (count - 1) / np.maximum(power, least**2)
    return np.where(_by_chance(share, count), 0.0, np.clip(share, -_CORRELATED, _CORRELATED))


def _by_chance(share: Array, count: int) -> Array:
    """Whether a correlation from instant to instant of so many instants may be that of white noise."""
    found: Array = np.abs(share) <= 2.0 / np.sqrt(count)
    return found


def _directions(rows: Array, noisy: Array | None) -> tuple[Array, Array]:
    """Which directions the rows show, shape (K,), and their inverse (K, rows) in those directions."""
    left, singular, right = np.linalg.svd(rows, full_matrices=False)
    shown = singular > _SHOWN * singular[0]
    if noisy is not None:
        shown &= np.linalg.norm(noisy @ right.T, axis=0) < _NOISE * singular
    inverse: Array = right[shown].T / singular[shown] @ left[:, shown].T
    return shown, inverse


def _middle(columns: Array, residual: Array) -> Array:
    """Covariance of the sums of weighted columns (T, n_joints, K) times residuals (T, n_joints), shape (K, K)."""
    middle = np.zeros((columns.shape[2], columns.shape[2]))
    for k, one in enumerate(residual.T):
        scores = columns[:, k] * one[:, None]
        middle += scores.T @ scores
        lags = _lags(one)
        for lag in range(1, lags + 1):
            across = scores[lag:].T @ scores[:-lag]
            middle += (1.0 - lag / (lags + 1.0)) * (across + across.T)
    return middle


def _lags(residual: Array) -> int:
    """Number of instants over which what is left is taken as correlated, 0 where that may be chance."""
    power = float((residual**2).sum())
    share = float((residual[1:] * residual[:-1]).sum()) / power if power > 0.0 else 0.0
    if _by_chance(np.array(share), len(residual)):
        return 0
    share = min(max(share, -0.97), 0.97)
    alpha = 4.0 * share**2 / ((1.0 - share) ** 2 * (1.0 + share) ** 2)
    return min(int(np.ceil(1.1447 * (alpha * len(residual)) ** (1.0 / 3.0))), len(residual) // 4)
