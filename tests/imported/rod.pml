<physicalModel name="rod"><atoms><structuralComponent>
<atom><atomProperties index="0" x="0" y="0" z="0"/></atom>
<atom><atomProperties index="1" x="1" y="0" z="0"/></atom>
<atom><atomProperties index="2" x="1" y="1" z="0"/></atom>
<atom><atomProperties index="3" x="0" y="1" z="0"/></atom>
<atom><atomProperties index="4" x="0" y="0" z="1"/></atom>
<atom><atomProperties index="5" x="1" y="0" z="1"/></atom>
<atom><atomProperties index="6" x="1" y="1" z="1"/></atom>
<atom><atomProperties index="7" x="0" y="1" z="1"/></atom>
</structuralComponent></atoms>
<exclusiveComponents><multiComponent name="Exclusive Components"><multiComponent name="Bodies">
<structuralComponent name="Cube" bodyType="FEM" young="100" poisson="0.3" density="1" deformation="SMALL">
<cell><cellProperties type="HEXAHEDRON"/><atomRef index="0"/><atomRef index="1"/><atomRef index="2"/><atomRef index="3"/><atomRef index="4"/><atomRef index="5"/><atomRef index="6"/><atomRef index="7"/></cell>
</structuralComponent></multiComponent></multiComponent></exclusiveComponents></physicalModel>
