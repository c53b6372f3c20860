import numpy as np
from scipy import stats

from ident.numerics.normal import normal_cdf, normal_quantile


def test_probabilities_are_those_of_scipy_far_out_in_the_tail_too():
    x = np.array([-30.0, -8.0, -1.3, 0.0, 0.4, 2.0, 7.0])
    np.testing.assert_allclose([normal_cdf(each) for each in x], stats.norm.cdf(x), rtol=1e-12)  # exp(450) rounded


def test_quantiles_are_those_of_scipy():
    p = np.array([1e-12, 0.05 / 14, 0.025, 0.5, 0.75, 0.999])
    # Near a half both subtract it from p.
    np.testing.assert_allclose([normal_quantile(each) for each in p], stats.norm.ppf(p), rtol=1e-13, atol=1e-15)
