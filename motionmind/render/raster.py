"""Compiled inner loops: from solids to a depth buffer, and from the buffer to colours; no bodies, no views.

Lengths are metres in the viewer's axes, x to the right, y up, z towards the viewer; parallel projection. A depth buffer
is passed as its arrays `solid`, `depth` and `shade` [H, W], and its `place`.
"""

from __future__ import annotations

from math import ceil, hypot, sqrt

from motionmind._typing import Floats, Indices, Int16s, Pixels, Singles
from motionmind.jit import jit
from motionmind.render.solids import EMPTY_CODE

Place = tuple[float, float, float]  # x and y of a buffer's upper left corner, metres, and pixels to a metre
Buffers = tuple[Int16s, Singles, Singles, Place]


@jit
def draw(
    solid: Int16s, depth: Singles, shade: Singles, place: Place, cones: Floats, balls: Floats, numbers: Int16s
) -> None:
    """Draw solids into a depth buffer: the nearest wins; where solids touch, as in a joint, the higher number wins.

    Args:
        solid, depth, shade, place: the buffer; its arrays are updated.
        cones: centres and radii of each round cone's ends, ax ay az bx by bz a_radius b_radius [N, 8], metres.
        balls: each ellipsoid's centre, and A A' for the matrix A with its half axes as columns [M, 4, 3].
        numbers: numbers of the solids, cones first [N + M].
    """
    buffer = solid, depth, shade, place
    for i in range(len(cones)):
        ax, ay, az, bx, by, bz, a, b = cones[i]
        # Seen from an end, a cone is two balls: one hides the other up to its rim.
        if (bx - ax) ** 2 + (by - ay) ** 2 - (b - a) ** 2 >= 1e-3 * max(a, b) ** 2:
            _cone(buffer, (ax, ay, az, a), (bx, by, bz, b), numbers[i])
        else:
            _ellipsoid(buffer, (ax, ay, az), (a * a, 0.0, 0.0, a * a, 0.0, a * a), numbers[i])
            _ellipsoid(buffer, (bx, by, bz), (b * b, 0.0, 0.0, b * b, 0.0, b * b), numbers[i])
    for i in range(len(balls)):
        (x, y, z), (xx, xy, xz), (_, yy, yz), (_, _, zz) = balls[i]
        _ellipsoid(buffer, (x, y, z), (xx, xy, xz, yy, yz, zz), numbers[len(cones) + i])


@jit
def _cone(
    buffer: Buffers, a: tuple[float, float, float, float], b: tuple[float, float, float, float], number: int
) -> None:
    """Draw a round cone that is not seen from an end; `a` and `b` are its ends' centres and radii.

    Its surface is the greatest z that any of its balls reaches. At the pixel p that is the maximum over t in [0, 1] of

        a_z + t d_z + sqrt(q(t)),  with q(t) = r(t)^2 - |p - c(t)|^2 = Q (A + 2 B t - t^2), Q > 0,

    where p and c(t) are in the picture's plane. Without bounds it is at t = B + d_z sqrt((B^2 + A) / (d_z^2 + Q)).
    """
    shade, place = buffer[2:]
    ax, ay, az, radius = a
    dx, dy, dz, widening = b[0] - ax, b[1] - ay, b[2] - az, b[3] - radius
    Q = dx * dx + dy * dy - widening * widening
    lean = dz / sqrt(dz * dz + Q)
    widest, length = max(radius, b[3]), hypot(dx, dy)
    rise = dy if abs(dy) > 1e-9 * length else 1e-9 * length
    slope, half = dx / rise, widest * length / abs(rise)
    left, step, per_Q, across = place[0] + 0.5 / place[2] - ax, 1.0 / place[2], 1.0 / Q, dx / Q
    low_x, high_x = min(-radius, dx - b[3]), max(radius, dx + b[3])
    first, after = _between(ay + max(radius, dy + b[3]), ay + min(-radius, dy - b[3]), place[1], -place[2], len(shade))
    for row in range(first, after):
        # Pixels lie in the cone's box, and in a strip along it that is as wide as its thicker end.
        y = place[1] - (row + 0.5) / place[2] - ay
        low, high = max(low_x, slope * y - half), min(high_x, slope * y + half)
        start, end = _between(ax + low, ax + high, place[0], place[2], shade.shape[1])
        row_A, row_B = (radius * radius - y * y) / Q, (radius * widening + dy * y) / Q  # what A and B are at x = 0
        for column in range(start, end):
            x = left + column * step
            A, B = row_A - x * x * per_Q, row_B + x * across
            t = min(max(B + lean * sqrt(max(B * B + A, 0.0)), 0.0), 1.0)
            square = A + t * (2.0 * B - t)
            if square > 0.0:
                towards = sqrt(Q * square)
                if _shows(buffer, row, column, az + t * dz + towards, number):
                    shade[row, column] = _brightness(y - t * dy, towards, radius + t * widening)


@jit
def _ellipsoid(
    buffer: Buffers,
    centre: tuple[float, float, float],
    square: tuple[float, float, float, float, float, float],
    number: int,
) -> None:
    """Draw an ellipsoid v' s^-1 v = 1 about its centre; `square` is the upper half of s = A A', row by row.

    Its shadow is the ellipse p' S^-1 p < 1, with S the picture's corner of s. Over a pixel p of it the surface is at

        z = k p + sqrt(d (1 - p' S^-1 p)),  with k = S^-1 (s_xz, s_yz) and d = s_zz - k (s_xz, s_yz).
    """
    shade, place = buffer[2:]
    xx, xy, xz, yy, yz, zz = square
    det = xx * yy - xy * xy
    ixx, ixy, iyy = yy / det, -xy / det, xx / det
    kx, ky = ixx * xz + ixy * yz, ixy * xz + iyy * yz
    d = zz - kx * xz - ky * yz
    left, step = place[0] + 0.5 / place[2] - centre[0], 1.0 / place[2]
    first, after = _between(centre[1] + sqrt(yy), centre[1] - sqrt(yy), place[1], -place[2], len(shade))
    for row in range(first, after):
        y = place[1] - (row + 0.5) / place[2] - centre[1]
        middle, half = centre[0] + xy / yy * y, sqrt(max(det / yy * (1.0 - y * y / yy), 0.0))
        start, end = _between(middle - half, middle + half, place[0], place[2], shade.shape[1])
        for column in range(start, end):
            x = left + column * step
            px, py = ixx * x + ixy * y, ixy * x + iyy * y
            rest = 1.0 - px * x - py * y
            if rest > 0.0:
                towards = sqrt(d * rest)
                if _shows(buffer, row, column, centre[2] + kx * x + ky * y + towards, number):
                    nz = towards / d
                    nx, ny = px - kx * nz, py - ky * nz
                    shade[row, column] = _brightness(ny, nz, sqrt(nx * nx + ny * ny + nz * nz))


@jit
def _brightness(up: float, towards: float, length: float) -> float:
    """Return a surface's brightness from its normal's components up and towards the viewer, and the normal's length.

    The light comes from above the viewer, and from neither side, so a mirrored body looks mirrored. Where it does not
    reach, the brightness is 0.62.
    """
    return 0.62 + (1.0 - 0.62) * max((0.6 * up + 0.8 * towards) / length, 0.0)


@jit
def _between(low: float, high: float, origin: float, scale: float, count: int) -> tuple[int, int]:
    """Return the range of pixels between `low` and `high`, metres, of `count` pixels, `scale` a metre from `origin`."""
    first, after = (low - origin) * scale, (high - origin) * scale
    return int(min(max(first, 0.0), count)), ceil(min(max(after, 0.0), count))


@jit
def _shows(buffer: Buffers, row: int, column: int, z: float, number: int) -> bool:
    """Put a solid's surface at depth z into a pixel; return whether the pixel shows it."""
    solid, depth, _, place = buffer
    ahead, hair = z - depth[row, column], 0.001 / place[2]  # within 0.001 pixels, surfaces coincide but for rounding
    depth[row, column] = max(depth[row, column], z)
    if ahead <= hair and (ahead < -hair or number < solid[row, column]):
        return False
    solid[row, column] = number
    return True


@jit
def colour(
    picture: Pixels,
    solid: Int16s,
    depth: Singles,
    shade: Singles,
    paints: Floats,
    parts: Indices,
    haze: tuple[float, float, float],
    step: float,
    line: int,
    ink: Pixels,
) -> None:
    """Paint the solids in a depth buffer over a picture.

    Lines run around the body and, where one body part stands before another, on the farther one.

    Args:
        picture: the background [H, W, 3], RGB; painted over.
        solid, depth, shade: the buffer.
        paints: RGB of the solids [N, 3], 0 to 255.
        parts: the body part of each solid [N].
        haze: the depths where haze begins and where it is full, metres, and its share of white there.
        step: least depth from one body part to another for a line between them, metres.
        line: width of the lines, pixels.
        ink: RGB of the lines [3].
    """
    height, width = solid.shape
    clear, whole, most = haze
    for row in range(height):
        for column in range(width):
            number = solid[row, column]
            if number == EMPTY_CODE:
                continue
            z, behind = depth[row, column], False
            for i in range(max(row - line, 0), min(row + line + 1, height)):
                if solid[i, column] == EMPTY_CODE:
                    picture[i, column] = ink
                elif solid[i, column] != number and parts[solid[i, column]] != parts[number]:
                    behind |= depth[i, column] > z + step
            for j in range(max(column - line, 0), min(column + line + 1, width)):
                if solid[row, j] == EMPTY_CODE:
                    picture[row, j] = ink
                elif solid[row, j] != number and parts[solid[row, j]] != parts[number]:
                    behind |= depth[row, j] > z + step
            if behind:
                picture[row, column] = ink
            else:
                far = most * min(max((clear - z) / (clear - whole), 0.0), 1.0)
                lit = (1.0 - far) * shade[row, column]
                for channel in range(3):
                    picture[row, column, channel] = int(paints[number, channel] * lit + 255.0 * far)
