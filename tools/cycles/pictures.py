"""How far a picture is from what it converges to, and whether two renderers converge to the same.

    relative squared error of a pixel = mean over channels of (x - ref)² / (ref² + (0.1 mean of ref)²)

The second term keeps pixels that are nearly black from counting without limit. Each renderer is measured against its own converged
picture: what is left then is noise. Whether the two pictures are of the same scene is another question, asked by agreement().
"""
import math
import statistics
import sys
from array import array

BLOCK = 8  # Pixels along the side of a block, over which noise averages out and bias stays.
TRIMMED = 0.001  # The share of pixels, those of the largest errors, that the trimmed mean leaves out.


def read_pfm(path):
    """Width, height and values, three a pixel, rows from the bottom."""
    with open(path, "rb") as file:
        kind, size, scale = (file.readline().split() for _ in range(3))
        width, height = map(int, size)
        values = array("f", file.read())
    if kind != [b"PF"] or len(values) != 3 * width * height:
        raise ValueError(f"{path}: is no colour PFM")
    if (float(scale[0]) < 0) != (sys.byteorder == "little"):
        values.byteswap()
    return width, height, values


def pixel_errors(picture, reference):
    """Relative squared error of each pixel, as above."""
    floor = (0.1 * statistics.fmean(reference)) ** 2
    squares = [(x - r) ** 2 / (r * r + floor) for x, r in zip(picture, reference)]
    return [sum(squares[i:i + 3]) / 3 for i in range(0, len(squares), 3)]


def errors(picture, reference):
    """Over the pixels: mean without the largest, mean of all, median."""
    each = sorted(pixel_errors(picture, reference))
    kept = each[:len(each) - math.ceil(TRIMMED * len(each))]
    return {"rel_mse": statistics.fmean(kept), "rel_mse_all": statistics.fmean(each), "rel_mse_median": statistics.median(each)}


def channel(values, index):
    return values[index::3]


def block_means(width, height, values):
    """Of whole blocks, channel by channel."""
    for top in range(0, height - BLOCK + 1, BLOCK):
        for left in range(0, width - BLOCK + 1, BLOCK):
            for index in range(3):
                first = [3 * ((top + y) * width + left) + index for y in range(BLOCK)]
                yield sum(sum(values[i:i + 3 * BLOCK:3]) for i in first) / BLOCK ** 2


def mean_variance(picture, reference, share):
    """Variance of the mean of each channel of a converged picture, from a noisy one. The errors of pixels are independent; the
    converged picture has `share` of the noisy one's variance."""
    count = len(picture) // 3
    return [share * sum((x - r) ** 2 for x, r in zip(channel(picture, i), channel(reference, i))) / count ** 2 for i in range(3)]


def agreement(size, ours, theirs, variances):
    """Of two converged pictures: ratios of the means of channels with their standard errors, and differences of blocks."""
    means = [[statistics.fmean(channel(values, i)) for i in range(3)] for values in (ours, theirs)]
    floor = 0.01 * statistics.fmean(theirs)
    blocks = sorted(abs(a - b) / (b + floor) for a, b in zip(block_means(*size, ours), block_means(*size, theirs)))
    return {
        "mean_ratio": [a / b if b else None for a, b in zip(*means)],
        "mean_ratio_error": [math.sqrt(va + vb) / b if b else None for va, vb, b in zip(*variances, means[1])],
        "block_difference_median": statistics.median(blocks) if blocks else None,
        "block_difference_p95": blocks[int(0.95 * len(blocks))] if blocks else None,
    }
