"""The unscented Kalman filter (Wan and van der Merwe, The Unscented Kalman Filter, 2001, section 7.3)."""

from __future__ import annotations

from typing import Any

import numpy as np

from pipros_robot.navigation.filter.kalman import ExtendedKalmanFilter
from pipros_robot.navigation.filter.state import ANGLES, SIZE, Array, Measurement, transition, wrapped


class UnscentedKalmanFilter(ExtendedKalmanFilter):
    """Like the extended filter, but with 31 sigma points instead of derivatives."""

    def __init__(
        self, *, alpha: float = 0.001, kappa: float = 0.0, beta: float = 2.0, **options: Any
    ) -> None:
        """Create the filter. `alpha`, `kappa` and `beta` determine the spread and the weights of the points.

        `options` are the arguments of ExtendedKalmanFilter.
        """
        super().__init__(**options)
        spread = alpha * alpha * (SIZE + kappa)
        self._spread = spread
        self._weights = np.full(2 * SIZE + 1, 0.5 / spread)
        self._weights[0] = (spread - SIZE) / spread
        self._covariance_weights = self._weights.copy()
        self._covariance_weights[0] += 1.0 - alpha * alpha + beta
        # The predicted points, until a correction uses them. As in robot_localization, a correction before
        # the first prediction has no effect.
        self._points: Array | None = np.zeros((2 * SIZE + 1, SIZE))

    def predict(self, time_s: float, delta_s: float) -> None:
        self._apply_control(time_s, delta_s)
        points = [transition(point[ANGLES], delta_s) @ point for point in self._sigma_points()]
        self._points = np.array(points)
        self.state = self._mean(self._points)
        apart = self._differences(self._points, self.state, np.arange(SIZE))
        self.covariance = self._product(apart, apart) + self._noise(delta_s)

    def correct(self, measurement: Measurement) -> bool:
        indices = measurement.usable()
        if not len(indices):
            return False
        points = self._sigma_points() if self._points is None else self._points
        noise = measurement.noise(indices)
        predicted = self._mean(points)
        apart = self._differences(points, self.state, np.arange(SIZE))
        measured = self._differences(points[:, indices], predicted[indices], indices)
        spread = self._product(measured, measured)
        inverse = np.linalg.inv(spread + noise)
        innovation = measurement.values[indices] - predicted[indices]
        innovation = self._differences(innovation[None], np.zeros(len(indices)), indices)[0]
        if not innovation @ inverse @ innovation < measurement.threshold * measurement.threshold:
            return False
        gain = self._product(apart, measured) @ inverse
        self.state = self._normal(self.state + gain @ innovation)
        self.covariance = self.covariance - gain @ spread @ gain.T
        self._points = None
        return True

    def _sigma_points(self) -> Array:
        root = _root(self._spread * self.covariance)
        around = np.concatenate([root.T, -root.T])
        return np.asarray(np.concatenate([self.state[None], self.state + around]))

    def _mean(self, points: Array) -> Array:
        mean = self._weights @ points
        sines, cosines = (self._weights @ function(points[:, ANGLES]) for function in (np.sin, np.cos))
        mean[ANGLES] = np.arctan2(sines, cosines)
        return np.asarray(mean)

    @staticmethod
    def _differences(points: Array, center: Array, indices: np.ndarray[Any, Any]) -> Array:
        apart = points - center
        angles = (indices >= ANGLES.start) & (indices < ANGLES.stop)
        apart[:, angles] = wrapped(apart[:, angles])
        return np.asarray(apart)

    def _product(self, left: Array, right: Array) -> Array:
        return np.asarray((left.T * self._covariance_weights) @ right)


def _root(covariance: Array) -> Array:
    """Return a matrix whose product with its transpose is the covariance.

    If an input has impossible correlations, the nearest valid covariance is used.
    """
    try:
        return np.linalg.cholesky(covariance)
    except np.linalg.LinAlgError:
        values, vectors = np.linalg.eigh((covariance + covariance.T) / 2)
        return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))
