/* A matrix whose columns are the axes of a quaternion w x y z. Any length will do; 0 is the identity. It
   is divided by its largest component first, so that squares neither overflow nor underflow. */

mat3 rotation(vec4 q) {
    float largest = max(max(abs(q.x), abs(q.y)), max(abs(q.z), abs(q.w)));
    q = largest < 1e-37 ? vec4(0) : q / largest;
    q *= 1 / sqrt(max(dot(q, q), 1e-30));
    float w = q.x, x = q.y, y = q.z, z = q.w;
    return mat3(1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y),
                2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x),
                2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y));
}
