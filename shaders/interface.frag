// Panels of the viewer.
#version 460
layout(binding = 0) uniform sampler2D picture;  // the font, white with its coverage as alpha, or a photograph
layout(location = 0) in vec2 uv;
layout(location = 1) in vec4 tint;
layout(location = 0) out vec4 colour;
void main() { colour = tint * texture(picture, uv); }
