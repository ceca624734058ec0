"""A picture's hole filled by shifted copies of the rest: which shifts there are, and which of them is taken where.

Patches of planks, tiles and weaves resemble others of the same picture at few offsets (He and Sun, "Statistics of Patch
Offsets for Image Completion", ECCV 2012): the maxima of its autocorrelation. From the hole's border inwards each place
takes the offset whose copy agrees best with what lies around it. Within one copy all of it agrees, so copies are large.
"""

from collections.abc import Iterator

import numpy as np
from scipy import fft, ndimage

from ...significance import LEVELS
from .params import TEXTURE


def completed(picture: np.ndarray, source: np.ndarray, hole: np.ndarray, scale: float) -> tuple[np.ndarray, np.ndarray]:
    """A picture whose hole shows copies of its source.

    Parameters
    ----------
    picture : (h, w, c) float32
        About 0, without what varies slowly.
    source, hole : (h, w) bool
        What may be copied, and where to. The rest is left as it is.
    scale : float
        Of `scale_of`, cells.

    Returns
    -------
    (h, w, c) float32, (h, w) bool
        Where there is a copy.
    """
    edge = max(int(round(TEXTURE.window * scale / TEXTURE.blocks)), 1)
    offsets = dominant_offsets(picture, source, hole, TEXTURE.window * scale)

    def copies() -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Each offset's copy, and where it shows the source; one at a time, as all are dozens of pictures."""
        return ((shifted(picture, shift), shifted(source, shift)) for shift in offsets)

    chosen = _labels(picture, source, hole, copies(), edge)
    result, done = picture.copy(), np.zeros(source.shape, bool)
    label = np.repeat(np.repeat(chosen, edge, 0), edge, 1)[: source.shape[0], : source.shape[1]]
    for k, (copy, valid) in enumerate(copies()):
        at = hole & valid & (label == k)
        result[at] = copy[at]
        done |= at
    # Single cells whose copy would come from beside the source take the next best offset that has something for them.
    for copy, valid in copies():
        at = hole & valid & ~done
        result[at] = copy[at]
        done |= at
    return result, done


def autocovariance(picture: np.ndarray, known: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean product of a picture and itself shifted, over what is known of both.

    Parameters
    ----------
    picture : (h, w, c) float32
        Of mean 0.
    known : (h, w) bool

    Returns
    -------
    covariance : (a, b) float32
        At shifts of [i, j] cells; those above a / 2 and b / 2 are negative ones.
    overlap : (a, b) float32
        Cells that each is the mean over.
    """
    shape = tuple(fft.next_fast_len(2 * edge, real=True) for edge in known.shape)

    def with_itself(values: np.ndarray) -> np.ndarray:
        return fft.irfft2(np.square(np.abs(fft.rfft2(values, shape))), shape)

    overlap = np.maximum(np.rint(with_itself(known.astype(np.float32))), 0)
    total = np.zeros(shape, np.float32)
    for c in range(picture.shape[2]):
        total += with_itself(picture[..., c] * known)
    return total / np.maximum(overlap, 1) / picture.shape[2], overlap


def scale_of(covariance: np.ndarray, overlap: np.ndarray) -> float:
    """Cells by which the autocovariance has fallen to `TextureParams.decay`; inf where it does not.

    Noise, which has nothing in common from cell to cell, does not count.
    """
    rows, columns = (np.minimum(np.arange(n), n - np.arange(n)) for n in covariance.shape)
    ring = np.rint(np.hypot(rows[:, None], columns[None])).astype(int).ravel()
    mean = np.bincount(ring, (covariance * overlap).ravel()) / np.maximum(np.bincount(ring, overlap.ravel()), 1)
    threshold = TEXTURE.decay * mean[1]
    below = np.flatnonzero(mean[1:] < threshold)
    if mean[1] <= 0 or not len(below):
        return np.inf
    last = int(below[0])
    return last + float((mean[last] - threshold) / max(mean[last] - mean[last + 1], 1e-30))


def typical_contrast(picture: np.ndarray, known: np.ndarray, edge: float) -> float:
    """Standard deviation of what neighbouring cells have in common, in the median over squares of some cells' edge.

    A stain, a highlight or a fringe is in few of them, a texture in most; noise is in none.
    """
    pairs, products = np.zeros(known.shape, np.float32), np.zeros(known.shape, np.float32)
    for shift in ((0, 1), (1, 0)):
        overlap = known & shifted(known, shift)
        pairs += overlap
        products += np.where(overlap, (picture * shifted(picture, shift)).mean(2), 0)
    count, total = (block_mean(pair_image, max(int(edge), 1)) for pair_image in (pairs, products))
    enough = count > 0.5  # a quarter of its pairs
    return float(np.sqrt(max(np.median(total[enough] / count[enough]), 0))) if enough.any() else 0.0


def dominant_offsets(picture: np.ndarray, source: np.ndarray, hole: np.ndarray, apart: float) -> list[tuple[int, int]]:
    """Offsets from the hole to the source by which the picture resembles itself most and that cover most of the hole.

    Parameters
    ----------
    apart : float
        Cells: no shorter offset, and of those nearer to each other the best one.
    """
    covariance, overlap = autocovariance(picture, source)
    shape, reach = covariance.shape, max(int(round(apart)), 1)
    is_peak = (ndimage.maximum_filter(covariance, 2 * reach + 1, mode="wrap") == covariance) & (overlap > reach * reach)
    rows, columns = (np.minimum(np.arange(n), n - np.arange(n)) for n in shape)
    is_peak &= np.hypot(rows[:, None], columns[None]) > reach
    peaks = np.flatnonzero(is_peak)
    similarity = np.square(np.maximum(covariance.ravel()[peaks] / covariance[0, 0], TEXTURE.unlike))
    best = np.argsort(-similarity, kind="stable")[: TEXTURE.peaks]
    shift, similarity = np.stack(np.divmod(peaks[best], shape[1]), 1), similarity[best]
    shift -= np.where(2 * shift > shape, shape, 0)
    # Which of them have something for which cells of the hole, some of them for all.
    cells = np.argwhere(hole)
    cells = cells[np.random.default_rng(0).permutation(len(cells))[: LEVELS.sample]]
    at = cells + shift[:, None]
    inside = ((at >= 0) & (at < source.shape)).all(2)
    covers = inside & source[tuple(np.moveaxis(np.where(inside[..., None], at, 0), 2, 0))]
    offsets: list[tuple[int, int]] = []
    uncovered = np.ones(len(cells), np.float32)
    while len(offsets) < TEXTURE.offsets and similarity.any():
        score = similarity * (covers @ uncovered)
        k = int(score.argmax())
        if not score[k]:
            break
        similarity[k] = 0
        offsets.append((int(shift[k, 0]), int(shift[k, 1])))
        uncovered[covers[k]] *= np.float32(TEXTURE.again)
    return offsets


def shifted(values: np.ndarray, shift: tuple[int, int]) -> np.ndarray:
    """What lies by a shift off each place; 0 where that is outside."""
    result = np.zeros_like(values)
    (h, w), (i, j) = values.shape[:2], shift
    if abs(i) < h and abs(j) < w:
        to = slice(max(-i, 0), h - max(i, 0)), slice(max(-j, 0), w - max(j, 0))
        result[to] = values[max(i, 0) : h - max(-i, 0), max(j, 0) : w - max(-j, 0)]
    return result


def block_mean(values: np.ndarray, edge: int) -> np.ndarray:
    """Means over blocks of edge x edge cells, float32; beyond the border is 0."""
    h, w = values.shape[:2]
    padded = np.pad(values, [(0, -h % edge), (0, -w % edge), *[(0, 0)] * (values.ndim - 2)])
    return padded.reshape(-(-h // edge), edge, -(-w // edge), edge, *values.shape[2:]).mean((1, 3), dtype=np.float32)


def _labels(picture, source, hole, copies, edge) -> np.ndarray:
    """Which of the copies each block takes, (h / edge, w / edge) int; -1: none."""

    def blocks(values: np.ndarray, valid: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        share = block_mean(valid, edge)
        return block_mean(values * valid[..., None], edge) / np.maximum(share, 1e-6)[..., None], share > 0.5

    current, settled = blocks(picture, source)
    known, coarse = settled.copy(), [blocks(*pair) for pair in copies]
    # How far a copy is off wherever both are known: what is expected of it before anything around a block is looked at.
    expected = [_mean_square(current - copy, settled & valid) for copy, valid in coarse]
    todo, everywhere = block_mean(hole, edge) > 0, False
    chosen = np.full(todo.shape, -1)
    window, structure = 2 * TEXTURE.blocks + 1, np.ones((3, 3), bool)
    while True:
        front = ndimage.binary_dilation(settled, structure, TEXTURE.blocks // 2) & todo
        if not front.any():
            if everywhere or not todo.any():
                return chosen
            todo, everywhere = ~settled, True  # what is left of the hole has no source beside it
            continue
        todo &= ~front
        place = np.flatnonzero(front)
        cost, label = np.full(len(place), np.inf), np.full(len(place), -1)
        for k, (copy, valid) in enumerate(coarse):
            overlap = settled & valid
            squared = np.where(overlap, np.square(current - copy).sum(2), 0)
            count, total = (
                ndimage.uniform_filter(image.astype(np.float32), window, mode="constant")[front]
                for image in (overlap, squared)
            )
            compared = valid[front] & (count * window * window > 0.5)
            mean = np.where(compared, (total + TEXTURE.before * expected[k]) / (count + TEXTURE.before), np.inf)
            better = mean < cost
            cost[better], label[better] = mean[better], k
        for k in np.unique(label[label >= 0]):
            at = np.unravel_index(place[label == k], chosen.shape)
            chosen[at] = k
            unknown = tuple(axis[~known[at]] for axis in at)
            current[unknown] = coarse[k][0][unknown]
            settled[at] = True


def _mean_square(off: np.ndarray, where: np.ndarray) -> float:
    """Mean square of an (h, w, c) difference over some cells, summed over the channels; 0 where there are none."""
    return float(np.square(off[where]).sum() / max(where.sum(), 1))


def smooth_mean(picture: np.ndarray, known: np.ndarray, sigma: float) -> np.ndarray:
    """Mean of what is known within a Gaussian's reach of each place, carried on from farther off where nothing is near.

    Parameters
    ----------
    picture : (h, w, c) float32
    known : (h, w) bool
    sigma : float
        Cells.
    """
    edge = max(int(sigma / 4), 1)
    share, total = block_mean(known, edge), block_mean(picture * known[..., None], edge)
    result, missing, width = np.zeros_like(total), np.ones_like(share), sigma / edge
    while True:
        mass, *sums = (
            ndimage.gaussian_filter(image, width, mode="constant") for image in (share, *np.moveaxis(total, 2, 0))
        )
        last = width > max(share.shape)
        # Where less than a quarter is known, the mean over twice the width takes the rest.
        part = missing if last else missing * np.minimum(4 * mass, 1)
        result += (part / np.maximum(mass, 1e-12))[..., None] * np.stack(sums, -1)
        missing = missing - part
        if last:
            break
        width *= 2
    grid = np.meshgrid(*((np.arange(n) + 0.5) / edge - 0.5 for n in known.shape), indexing="ij")
    channels = [ndimage.map_coordinates(image, grid, order=1, mode="nearest") for image in np.moveaxis(result, 2, 0)]
    return np.stack(channels, -1)
