"""Control laws for the interface of controllers: individual pitch, yaw, preview, and their filters."""
