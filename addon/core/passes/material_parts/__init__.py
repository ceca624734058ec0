"""Objects of several materials: their connected pieces set apart where they look unlike the rest."""
