"""What accuracy costs, what breaks, and what a scene needs: measured on the machine at hand."""
