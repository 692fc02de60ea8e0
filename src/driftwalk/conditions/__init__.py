"""What a simulation or a fit takes over from a recording: tank and block, reconciled with the study."""
