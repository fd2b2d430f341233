#version 300 es
// Purpose: one triangle that covers the target; no vertex data.

void main() {
    gl_Position = vec4(4.0 * float(gl_VertexID == 1) - 1.0, 4.0 * float(gl_VertexID == 2) - 1.0, 0.0, 1.0);
}
