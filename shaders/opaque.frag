// First pass for triangles that are opaque everywhere. It reads nothing, so depth can be tested and written early.
#version 460
layout(location = 0) flat in uint triangle;  // index + 1
layout(location = 0) out uint hit;

void main() { hit = triangle; }
