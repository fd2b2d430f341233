#version 330 core
// Purpose: depth only.

void main() {}
