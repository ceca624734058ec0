"""Running medians against NumPy's, and P-square against its article."""

from __future__ import annotations

import numpy as np
import pytest

from addon.core.lit_diffuse.medians import Exact, Mean, PSquare, make_estimator

ARTICLE = [0.02, 0.15, 0.74, 3.39, 0.83, 22.37, 10.15, 15.43, 38.62, 15.92,
           34.60, 10.28, 1.47, 0.40, 0.05, 11.39, 0.27, 0.42, 0.09, 11.37]  # fmt: skip
"""The 20 observations of Jain and Chlamtac (1985), table I; the estimate of their median is 4.44."""


def one_by_one(estimator, values):
    for value in values:
        estimator.add(np.zeros(1, np.int32), np.full((1, 3), value, np.float32))
    return estimator.result()


def ragged(rng, counts):
    """Rounds of observations, in counts[i] of which element i is; and the values of each element."""
    rounds = int(counts.max())
    values, added = [[] for _ in counts], []
    for r in range(rounds):
        share = (counts > 0) & ((counts * (r + 1)) // rounds > (counts * r) // rounds)
        element = np.flatnonzero(share).astype(np.int32)
        x = (10 ** rng.uniform(-4, 2, (len(element), 3))).astype(np.float32)  # six decades
        ties = rng.random(len(element)) < 0.2
        x[ties] = np.float32(0.25)
        x[rng.random(len(element)) < 0.05] = 0
        for e, v in zip(element, x):
            values[e].append(v)
        added.append((element, x))
    return added, values


@pytest.mark.parametrize(("bucket", "held"), [(None, None), (16, None), (16, 700), (7, 1)])
def test_exact_is_numpys_median(bucket, held, tmp_path, monkeypatch):
    """Whether all is held, or flushed to the file many times; one bucket or many."""
    if bucket:
        monkeypatch.setattr(Exact, "BUCKET", bucket)
    if held:
        monkeypatch.setattr(Exact, "HELD", held)
    rng = np.random.default_rng(0)
    counts = np.array([0, 1, 2, 3, 4, 5, 6, 7, 0, 300, 299, 150, *rng.integers(0, 40, 60), 0])
    exact = Exact(len(counts), tmp_path)
    added, values = ragged(rng, counts)
    for element, x in added:
        exact.add(element, x)
    result = exact.result()
    assert result.count.tolist() == counts.tolist() == [len(v) for v in values]
    for e, seen in enumerate(values):
        for got, share in ((result.lower, 0.25), (result.median, 0.5), (result.upper, 0.75)):
            if seen:
                assert np.allclose(got[e], np.quantile(np.array(seen, float), share, axis=0), rtol=2e-6, atol=1e-12)
            else:
                assert np.isnan(got[e]).all()
        if seen:
            assert np.allclose(result.median[e], np.median(seen, axis=0), rtol=1e-6)
    assert result.median.dtype == np.float32 and result.count.dtype == np.int32
    assert list(tmp_path.iterdir()) == []  # nothing stays on disk


def test_exact_over_more_than_one_bucket(tmp_path):
    count = 2 * Exact.BUCKET + 3
    rng = np.random.default_rng(1)
    seen = rng.random((5, count)) < 0.5
    seen[:, Exact.BUCKET - 1 : Exact.BUCKET + 1] = True
    x = rng.random((5, count, 3), np.float32)
    exact = Exact(count, tmp_path)
    for s, v in zip(seen, x):
        exact.add(np.flatnonzero(s).astype(np.int32), v[s])
    result = exact.result()
    some = seen.any(0)
    wanted = np.nanmedian(np.where(seen[..., None], x, np.nan)[:, some], 0)
    assert np.allclose(result.median[some], wanted, rtol=1e-6)
    assert np.isnan(result.median[~some]).all() and np.array_equal(result.count, seen.sum(0))


def test_exact_takes_zeros_of_either_sign():
    """Half-float pictures hold -0.0, which passes as 'not negative'."""
    assert one_by_one(Exact(1), [-0.0, -0.0, 1.0]).median[0, 0] == 0


@pytest.mark.parametrize("name", ["exact", "p2", "mean"])
def test_nothing_added_gives_nothing(name):
    result = make_estimator(name, 3).result()
    assert result.count.tolist() == [0, 0, 0] and np.isnan(result.median).all()
    assert make_estimator(name, 0).result().median.shape == (0, 3)


def test_p_square_gives_the_articles_example():
    result = one_by_one(PSquare(1), ARTICLE)
    assert result.median[0] == pytest.approx([4.44] * 3, abs=0.005)
    assert result.count[0] == 20


def p_square_of_the_article(x: np.ndarray) -> float:
    """Jain and Chlamtac's box 1 for p = 0.5, word by word, in float64."""
    q, n = sorted(float(v) for v in x[:5]), [1, 2, 3, 4, 5]
    for count, v in enumerate(map(float, x[5:]), 6):
        if v < q[0]:
            q[0], k = v, 0
        elif v >= q[4]:
            q[4], k = max(v, q[4]), 3
        else:
            k = max(i for i in range(4) if q[i] <= v)
        n = [n[i] + (i > k) for i in range(5)]
        for i in (1, 2, 3):
            d = 1 + (count - 1) * i / 4 - n[i]
            if (d >= 1 and n[i + 1] - n[i] > 1) or (d <= -1 and n[i - 1] - n[i] < -1):
                d = 1 if d > 0 else -1
                rise, fall = (q[i + 1] - q[i]) / (n[i + 1] - n[i]), (q[i] - q[i - 1]) / (n[i] - n[i - 1])
                new = q[i] + d / (n[i + 1] - n[i - 1]) * ((n[i] - n[i - 1] + d) * rise + (n[i + 1] - n[i] - d) * fall)
                if not q[i - 1] < new < q[i + 1]:
                    new = q[i] + d * (q[i + d] - q[i]) / (n[i + d] - n[i])
                q[i] = new
                n[i] += d
    return q[2]


@pytest.mark.parametrize("ties", [False, True])
def test_p_square_is_the_articles_algorithm(ties):
    assert p_square_of_the_article(ARTICLE) == pytest.approx(4.44, abs=0.005)
    x = np.random.default_rng(2).lognormal(0, 1.5, (150, 40, 3)).astype(np.float32)
    x = np.round(4 * x) / 4 if ties else x
    p2, every = PSquare(40), np.arange(40, dtype=np.int32)
    for values in x:
        p2.add(every, values)
    wanted = [[p_square_of_the_article(x[:, e, c]) for c in range(3)] for e in range(40)]
    assert np.allclose(p2.result().median, wanted, rtol=1e-3)


def highlights(rng, n: int, elements: int = 300):
    """n noisy observations of radiance 1, of which 20 % have a highlight on top (3.25 in the mean); in random order."""
    bright = rng.permuted(np.broadcast_to(np.arange(n)[:, None, None] < n // 5, (n, elements, 1)), axis=0)
    on_top = bright * rng.exponential(3.25, (n, elements, 1))
    return (np.exp(rng.normal(0, 0.03, (n, elements, 3))) * (1 + on_top)).astype(np.float32)


def test_p_square_follows_ragged_counts():
    """Elements that start late must not disturb the others."""
    rng = np.random.default_rng(3)
    counts = np.array([0, 1, 3, 5, 6, 40, 200, 200])
    together = PSquare(len(counts))
    added, values = ragged(rng, counts)
    for element, x in added:
        together.add(element, x)
    result = together.result()
    for e, seen in enumerate(values):
        alone = PSquare(1)
        for v in seen:
            alone.add(np.zeros(1, np.int32), v[None])
        assert np.array_equal(alone.result().median[0], result.median[e], equal_nan=True)


def test_mean_and_deviation():
    x = np.random.default_rng(0).random((50, 4, 3), np.float32) + 1
    mean, every = Mean(5), np.arange(4, dtype=np.int32)
    for values in x:
        mean.add(every, values)
    result = mean.result()
    assert np.allclose(result.median[:4], x.mean(0), rtol=1e-5)
    assert np.allclose(result.upper[:4] - result.median[:4], x.std(0, ddof=1), rtol=1e-4)
    assert np.isnan(result.median[4]).all() and result.count.tolist() == [50] * 4 + [0]


def held_bytes(value) -> int:
    """Bytes of all arrays that an estimator holds."""
    if isinstance(value, np.ndarray):
        return value.nbytes
    if isinstance(value, (Exact, PSquare, Mean)):
        value = list(vars(value).values())
    return sum(map(held_bytes, value)) if isinstance(value, (list, tuple)) else 0


@pytest.mark.parametrize("name", ["exact", "p2", "mean"])
def test_memory_does_not_grow_with_the_observations(name, monkeypatch, tmp_path):
    monkeypatch.setattr(Exact, "HELD", 1000)
    estimator, every = make_estimator(name, 100, tmp_path), np.arange(100, dtype=np.int32)
    sizes = []
    for _ in range(200):
        estimator.add(every, np.ones((100, 3), np.float32))
        sizes.append(held_bytes(estimator))
    assert max(sizes[100:]) <= max(sizes[:100]) + 100 * 16 * 20  # of Exact some words for each flush
    assert max(sizes) < (1.5 * 1000 * 16 if name == "exact" else 248 * 100)
    assert estimator.result().count.tolist() == [200] * 100


def test_median_drops_a_minority_that_the_mean_keeps():
    x = highlights(np.random.default_rng(9), 50)
    every = np.arange(x.shape[1], dtype=np.int32)
    exact, mean = Exact(x.shape[1]), Mean(x.shape[1])
    for values in x:
        exact.add(every, values)
        mean.add(every, values)
    assert np.abs(np.log(exact.result().median)).max() < 0.1
    assert np.median(mean.result().median) > 1.5
