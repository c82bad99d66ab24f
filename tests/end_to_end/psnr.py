"""psnr.py A.png B.png LEAST: fails if the pictures differ in size or by less than LEAST dB in RGB."""
import math
import struct
import sys
import zlib


def read(path):
    """Returns the size and the RGB rows of a PNG of 8 bits per channel without interlacing."""
    data = open(path, 'rb').read()
    width, height, depth, kind, _, _, interlaced = struct.unpack('>IIBBBBB', data[16:29])
    assert depth == 8 and kind in (2, 6) and not interlaced, path
    channels = 3 if kind == 2 else 4
    at, packed = 8, b''
    while at < len(data):
        length, name = struct.unpack('>I4s', data[at:at + 8])
        if name == b'IDAT':
            packed += data[at + 8:at + 8 + length]
        at += 12 + length
    raw, stride = zlib.decompress(packed), width * channels
    above, rows = bytearray(stride), []
    for y in range(height):
        method = raw[y * (stride + 1)]
        row = bytearray(raw[y * (stride + 1) + 1:(y + 1) * (stride + 1)])
        for i in range(stride):
            left, up = (row[i - channels] if i >= channels else 0), above[i]
            corner = above[i - channels] if i >= channels else 0
            guess = left + up - corner
            paeth = min((abs(guess - left), 0, left), (abs(guess - up), 1, up), (abs(guess - corner), 2, corner))[2]
            row[i] = (row[i] + (0, left, up, (left + up) // 2, paeth)[method]) & 255
        rows.append([row[i] for i in range(stride) if channels == 3 or i % 4 < 3])
        above = row
    return (width, height), rows


(size_a, a), (size_b, b) = read(sys.argv[1]), read(sys.argv[2])
if size_a != size_b:
    sys.exit(f'{sys.argv[1]} is {size_a}, {sys.argv[2]} {size_b}')
squares = sum((x - y) ** 2 for p, q in zip(a, b) for x, y in zip(p, q)) / (3 * size_a[0] * size_a[1])
psnr = math.inf if squares == 0 else 10 * math.log10(255 ** 2 / squares)
print(f'{psnr:.2f} dB')
if psnr < float(sys.argv[3]):
    sys.exit(f'{sys.argv[1]} and {sys.argv[2]}: {psnr:.2f} dB')
