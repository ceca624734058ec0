"""The room's surface: texel atlas, surface elements, and rays against it."""
