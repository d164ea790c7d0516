/* What all programs begin with. A group is 256 threads, or a tile's pixels. group() counts through groups,
   where they are more than a dimension can have, too. No loop in these files is left by return: NVIDIA's
   driver 580 takes its step even so. */

layout(local_size_x = 256) in;
uint lane() { return gl_LocalInvocationIndex; }
uint group() { return gl_WorkGroupID.x + gl_WorkGroupID.y * gl_NumWorkGroups.x; }
uint item() { return group() * 256u + lane(); }
