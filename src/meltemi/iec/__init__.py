"""Wind models of IEC 61400-1: classes, normal and extreme winds, gusts."""

KERNELS = ()
